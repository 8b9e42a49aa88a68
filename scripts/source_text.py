"""C++ as text: what is code, what is comment, where functions begin and end. Heuristics that hold for clang-formatted
code, without a compiler."""
import re

# What is no code. A quote after a letter or digit is a digit separator (1'000), not a character.
_NO_CODE = re.compile(
    r'(?P<comment>//(?:\\\n|[^\n])*|/\*.*?\*/)'
    r'|(?P<raw>\b(?:u8|[uUL])?R"(?P<mark>[^\s()\\]{0,16})\(.*?\)(?P=mark)")'
    r'|(?P<text>"(?:\\.|[^"\\\n])*"|(?<!\w)(?:u8|[uUL])?\'(?:\\.|[^\'\\\n])+\')',
    re.DOTALL)
_DIRECTIVE = re.compile(r'^[ \t]*#(?:\\\n|[^\n])*', re.MULTILINE)
# What stands before a declaration and is no part of it: an access specifier, a line that is a macro's call.
_ASIDE = re.compile(r'^(\s*((public|private|protected)\s*:(?!:)|[A-Z][A-Z0-9_]*\([^()\n]*\)[ \t]*\n))+')
_PUNCTUATION = re.compile(r'[{};]')
_BRACE = re.compile(r'[{}]')
_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?P<form>[<"])(?P<name>[^>"\n]+)[>"]', re.MULTILINE)


def _blank(match):
    return re.sub(r'[^\n]', ' ', match.group(0))


def blank(text):
    """The text with blanks for comments, strings and characters."""
    return _NO_CODE.sub(_blank, text)


def line_of(text, position):
    return text.count('\n', 0, position) + 1


def includes(text):
    """(line, '<' or '"', name) of each #include that is neither in a comment nor in a raw string."""
    code = _NO_CODE.sub(lambda m: m.group(0) if m.group('text') else _blank(m), text)
    return [(line_of(code, m.start('form')), m.group('form'), m.group('name')) for m in _INCLUDE.finditer(code)]


def _without_template(head):
    """The head of a declaration without template <...>, requires clauses left in."""
    head = head.lstrip()
    while re.match(r'template\s*<', head):
        depth = 0
        for i, c in enumerate(head):
            depth += (c == '<') - (c == '>')
            if c == '>' and depth == 0:
                head = head[i + 1:].lstrip()
                break
        else:
            return ''
    return head


def _kind(head):
    """What a brace opens, told by what stands before it: 'scope' (of a namespace or type), 'function' or 'values'."""
    head = _without_template(head)
    if re.match(r'(inline\s+)?namespace\b|extern\s*$', head):
        return 'scope'
    if head.count('(') > head.count(')'):
        return 'values'
    outside = _outside(head)
    if re.match(r'(typedef\s+|static\s+|inline\s+|constexpr\s+|const\s+)*(class|struct|union|enum)\b', outside):
        if '(' not in outside.replace('alignas()', ''):
            return 'scope'
    # A default argument's = is inside of the parentheses, that of a variable is not.
    if '=' in re.sub(r'operator\s*[-+*/%&|^<>=!]*', '', outside):
        return 'values'
    return 'function' if '(' in outside else 'values'


def _outside(head):
    """The head with nothing left between its parentheses."""
    kept, depth = '', 0
    for c in head:
        depth -= c == ')'
        kept += c if depth == 0 else ''
        depth += c == '('
    return kept


def _name(head):
    """The function's name, for people."""
    head = ' '.join(_without_template(head).split())
    found = re.search(r'((?:\w+(?:<[^()]*>)?::)*(?:operator\s*(?:\(\)|[^\s(]+)|~?\w+))\s*\(', head)
    return found.group(1).strip() if found else head[:60]


def functions(text):
    """(first line, last line, name) of each function: from the line on which its signature begins (after template<>)
    to that of its closing brace. Lambdas and local classes count to the function that they are in."""
    code = _DIRECTIVE.sub(_blank, _NO_CODE.sub(_blank, text))
    found = []
    start = at = 0  # of what comes next: its head, and how far it has been read
    while match := _PUNCTUATION.search(code, at):
        at = match.end()
        if match.group(0) != '{':  # a declaration, or the end of a scope: functions are passed whole
            start = at
            continue
        head = _ASIDE.sub('', code[start:match.start()])
        kind = _kind(head)
        if kind == 'scope':
            start = at
            continue
        close = _closing(code, match.start())
        at = close + 1
        if kind == 'values' or code[at:at + 80].lstrip()[:1] in (',', '{', ')'):
            continue  # a default value, or one of a constructor's initialisers: the head goes on
        signature = match.start() - len(_without_template(head))
        found.append((line_of(code, signature), line_of(code, close), _name(head)))
        start = at
    return found


def _closing(code, opening):
    depth = 0
    for match in _BRACE.finditer(code, opening):
        depth += 1 if match.group(0) == '{' else -1
        if depth == 0:
            return match.start()
    return len(code) - 1

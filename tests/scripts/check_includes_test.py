#!/usr/bin/env python3
"""scripts/check_includes.py on small trees: it passes what is right and names each thing that is wrong by file and
line."""
import contextlib
import io
import pathlib
import sys
import tempfile
import textwrap
import unittest
import xml.etree.ElementTree

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import check_includes

GOOD = {
    "include/cairn/types.hpp": "#include <Eigen/Core>\n#include <cstdint>\n",
    "include/cairn/shapes.hpp": "#include <cairn/types.hpp>\n",
    "include/cairn/world.hpp": "#include <cairn/shapes.hpp>\n#include <cairn/joints/ball.hpp>\n",
    "include/cairn/joints/ball.hpp": "#include <cairn/types.hpp>\n",
    "include/cairn/cairn.h": "#include <stdint.h>\n#include <stddef.h>\n",
    "base/pose.cpp": "#include <cairn/types.hpp>\n",
    "base/loops.hpp": "",
    "collision/narrow_phase/gjk.hpp": '#include <cairn/shapes.hpp>\n#include "base/loops.hpp"\n',
    "collision/narrow_phase/fcl_pair.cpp": "#include <fcl/common/types.h>\n",
    "engine/model/body.hpp": "#include <cairn/world.hpp>\n",
    "engine/solve/problem.hpp": '#include "engine/model/body.hpp"\n',
    "engine/solve/velocity/sweep.hpp": '#include "engine/solve/problem.hpp"\n',
    "engine/solve/auto.cpp": '#include "engine/solve/velocity/sweep.hpp"\n',
    "engine/world/world.cpp": '#include <cairn/world.hpp>\n#include "engine/solve/problem.hpp"\n',
    "assets/scene.hpp": '#include "engine/world/world.hpp"\n',
    "engine/world/world.hpp": "",
    "render/draw.cpp": '#include "base/loops.hpp"\n#include <cairn/types.hpp>\n',
    "demos/scenes/tower.cpp": '#include "assets/scene.hpp"\n',
    "command/main.cpp": '#include "engine/solve/problem.hpp"\n#include <CLI/CLI.hpp>\n',
    "tests/engine/kit.hpp": '#include "engine/solve/problem.hpp"\n',
    "tests/engine/world_test.cpp": '#include "kit.hpp"\n',
    "demos/game/game.cpp": '#include "engine/engine.hpp"\n',
    "build/generated.cpp": '#include "nowhere.hpp"\n',
}


class TreeTest(unittest.TestCase):
    def run_on(self, changes, *options, tree=None):
        """(exit code, what was printed) for a tree with some of its files changed. ROOT in an option is its folder."""
        files = dict(GOOD if tree is None else tree, **changes)
        printed = io.StringIO()
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in files.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            arguments = ["--root", folder] + [option.replace("ROOT", folder) for option in options]
            with contextlib.redirect_stdout(printed):
                code = check_includes.main(arguments)
            self.drawn = {file.name: file.read_text() for file in root.iterdir() if file.suffix in (".svg", ".dot")}
        return code, printed.getvalue()


class Arrows(TreeTest):
    def expect(self, changes, *findings):
        code, words = self.run_on(changes)
        self.assertEqual(code, 1 if findings else 0, words)
        for finding in findings:
            self.assertIn(finding, words)
        self.assertIn(f"{len(findings)} findings", words)

    def test_a_tree_in_order_passes(self):
        self.expect({})

    def test_a_lower_layer_may_not_include_a_higher_one(self):
        self.expect({"collision/narrow_phase/gjk.hpp": '\n\n#include "engine/model/body.hpp"\n'},
                    "collision/narrow_phase/gjk.hpp:3: includes engine/model/body.hpp: collision stands below "
                    "engine/model")

    def test_layers_inside_the_engine_hold_too(self):
        self.expect({"engine/model/joint.cpp": '#include "engine/world/world.hpp"\n'},
                    "engine/model/joint.cpp:1: includes engine/world/world.hpp")

    def test_render_knows_neither_engine_nor_collision(self):
        self.expect({"render/draw.cpp": '#include "engine/model/body.hpp"\n'},
                    "render/draw.cpp:1: includes engine/model/body.hpp: render does not stand on engine/model")
        self.expect({"render/draw.cpp": "#include <cairn/shapes.hpp>\n"},
                    "render/draw.cpp:1: includes include/cairn/shapes.hpp: render does not stand on collision")

    def test_public_headers_have_layers(self):
        self.expect({"base/pose.cpp": "#include <cairn/world.hpp>\n"},
                    "base/pose.cpp:1: includes include/cairn/world.hpp: base stands below engine/model")
        self.expect({"include/cairn/types.hpp": "#include <cairn/shapes.hpp>\n", "include/cairn/shapes.hpp": ""},
                    "include/cairn/types.hpp:1: includes include/cairn/shapes.hpp: base stands below collision")

    def test_public_headers_include_only_what_is_installed(self):
        self.expect({"include/cairn/world.hpp": '#include "engine/solve/auto.hpp"\n',
                     "engine/solve/auto.hpp": ""},
                    "include/cairn/world.hpp:1: includes engine/solve/auto.hpp: a public header may not")
        self.expect({"include/cairn/world.hpp": "#include <nlohmann/json.hpp>\n"},
                    "include/cairn/world.hpp:1: includes <nlohmann/json.hpp>: a public header may")

    def test_libraries_are_seen_where_the_table_says(self):
        self.expect({"collision/narrow_phase/gjk.hpp": "#include <fcl/common/types.h>\n"},
                    "collision/narrow_phase/gjk.hpp:1: includes <fcl/common/types.h>: only")

    def test_a_circle_of_files(self):
        self.expect({"base/a.hpp": '#include "base/b.hpp"\n', "base/b.hpp": '\n#include "base/c.hpp"\n',
                     "base/c.hpp": '#include "base/a.hpp"\n'},
                    "base/a.hpp:1: circle of files: base/a.hpp:1 -> base/b.hpp:2 -> base/c.hpp:1 -> base/a.hpp")
        self.expect({"base/a.hpp": '#include "base/a.hpp"\n'}, "circle of files: base/a.hpp:1 -> base/a.hpp")
        self.expect({"tests/a.hpp": '#include "b.hpp"\n', "tests/b.hpp": '#include "a.hpp"\n'}, "circle of files")

    def test_a_circle_of_folders_through_different_files(self):
        self.expect({"command/tune/tune.cpp": '#include "command/bench/bench.hpp"\n', "command/tune/page.hpp": "",
                     "command/bench/bench.hpp": "", "command/bench/table.cpp": '#include "command/tune/page.hpp"\n'},
                    "circle of folders: command/bench/ -> command/tune/ -> command/bench/")

    def test_a_circle_of_a_folder_and_a_unit_beside_it(self):
        self.expect({"engine/solve/auto.hpp": "",
                     "engine/solve/velocity/jacobi.cpp": '#include "engine/solve/auto.hpp"\n'},
                    "circle of folders: engine/solve/auto -> engine/solve/velocity/ -> engine/solve/auto")

    def test_a_folder_may_stand_between_two_units_beside_it(self):
        code, words = self.run_on({}, "--notes")
        self.assertEqual(code, 0)
        self.assertIn("note: files of engine/solve and of engine/solve/velocity include each other", words)

    def test_what_is_no_include_is_not_read(self):
        self.expect({"base/words.cpp": textwrap.dedent('''\
            // #include "engine/model/body.hpp"
            /*
            #include "engine/model/body.hpp"
            */
            const char* page = R"html(
            #include "engine/model/body.hpp"
            )html";
            const char* quotes = "// no comment \\" /*";
            #include "base/loops.hpp"
            ''')})

    def test_paths_are_from_the_root(self):
        self.expect({"base/pose.cpp": '#include "loops.hpp"\n'},
                    'base/pose.cpp:1: includes "loops.hpp": write its path from the root, "base/loops.hpp"')
        self.expect({"base/pose.cpp": '#include "include/cairn/types.hpp"\n'}, "write <cairn/types.hpp>")
        self.expect({"base/pose.cpp": "#include <base/loops.hpp>\n"}, 'write "base/loops.hpp"')

    def test_what_does_not_exist(self):
        self.expect({"base/pose.cpp": '#include "base/missing.hpp"\n#include <cairn/missing.hpp>\n'},
                    'base/pose.cpp:1: includes "base/missing.hpp": there is no such file',
                    "base/pose.cpp:2: includes <cairn/missing.hpp>: there is no include/cairn/missing.hpp")

    def test_every_file_stands_somewhere(self):
        self.expect({"engine/stray.hpp": "", "other/thing.cpp": ""},
                    "engine/stray.hpp:1: stands in no layer", "other/thing.cpp:1: stands in no layer")

    def test_no_layer_includes_tests(self):
        self.expect({"command/main.cpp": '#include "tests/engine/kit.hpp"\n'},
                    "command/main.cpp:1: includes tests/engine/kit.hpp: no layer includes tests")

    def test_pictures(self):
        code, _ = self.run_on({"base/wrong.cpp": '#include "engine/model/body.hpp"\n'}, "--draw", "ROOT/picture.svg")
        self.assertEqual(code, 1)
        picture = xml.etree.ElementTree.fromstring(self.drawn["picture.svg"])
        words = "".join(picture.itertext())
        self.assertIn("engine/solve/velocity", words)
        self.assertIn("base includes engine/model, 1 times", words)
        self.assertEqual(self.drawn["picture.svg"].count('<g stroke="#d00000"'), 1)
        code, _ = self.run_on({}, "--draw", "ROOT/picture.dot")
        self.assertEqual(code, 0)
        self.assertIn('"engine/solve/velocity" -> "engine/solve"', self.drawn["picture.dot"])

    def test_other_tables(self):
        tables = '{"layers": {"low": [], "high": ["low"]}, "public": []}'
        tree = {"low/a.hpp": '#include "high/b.hpp"\n', "high/b.hpp": "", "tables.json": tables}
        code, words = self.run_on({}, "--layers", "ROOT/tables.json", tree=tree)
        self.assertEqual(code, 1)
        self.assertIn("low/a.hpp:1: includes high/b.hpp: low stands below high", words)


class Lines(TreeTest):
    def lines_of(self, text, longest):
        code, words = self.run_on({}, "--max-function", str(longest), tree={"base/a.cpp": text})
        return code, words

    def test_functions_are_measured_from_signature_to_brace(self):
        body = "    int x = 0;\n" * 8
        for head in ("int f(int a, std::vector<int> b = {1, 2}) {\n", "template <class S>\nvoid World<S>::f() {\n",
                     "Thing::Thing(int a)\n    : a_{a}, b_(0), c_{1, 2} {\n", "bool operator==(A a, B b) {\n",
                     "struct Thing {\npublic:\n    int x = f({1});\n    int f() const {\n",
                     "#define CALL(x) \\\n    f(x) {\nMACRO(f)\nint f() {\n",
                     'extern "C" {\nint f(char c = \'{\', const char* d = "{{{") {\n'):
            code, words = self.lines_of(f"namespace a {{\n{head}{body}}}\n", 9)
            self.assertEqual(code, 1, words)
            self.assertIn("1 functions over 9 lines", words)
            code, words = self.lines_of(f"namespace a {{\n{head}{body}}}\n", 12)
            self.assertEqual(code, 0, words)

    def test_tables_types_and_enums_are_no_functions(self):
        rows = "    {1, 2},\n" * 20
        code, words = self.lines_of(f"namespace a {{\nconst int t[] = {{\n{rows}}};\nstruct A final : B<f(3)> {{\n"
                                    f"{'    int f();' * 20}}};\nenum class E : int {{\n{'    x,' * 20}\n}};\n}}\n", 5)
        self.assertEqual(code, 0, words)

    def test_a_lambda_counts_to_its_function(self):
        code, words = self.lines_of("int f() {\n    g([] {\n" + "        h();\n" * 9 + "    });\n}\n", 5)
        self.assertEqual(code, 1)
        self.assertIn("base/a.cpp:1: f has 13 lines", words)

    def test_long_files_are_told_and_fail_only_where_asked(self):
        text = "\n" * 700
        code, words = self.run_on({}, "--lines", tree={"base/a.cpp": text, "tests/b.cpp": text})
        self.assertEqual(code, 0)
        self.assertIn("base/a.cpp: 700 lines", words)
        self.assertNotIn("tests", words)
        self.assertEqual(self.run_on({}, "--max-file", "600", tree={"base/a.cpp": text})[0], 1)


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/env python3
"""scripts/check_docs.py on a small page and a command that always says the same: it passes what is right, names what is
off, and mends it."""
import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import check_docs

COMMAND = """#!/bin/sh
echo '{"error": {"gap_m": 0.00123, "depth_m": 2e-9, "fall_m": null}, "flags": ["energy"]}'
"""
CLAIM = {"file": "docs/page.md", "command": "run chain", "value": "/error/gap_m mm", "noise": 0.01}


class Docs(unittest.TestCase):
    def check(self, page, claims, *options):
        """(exit code, what was printed); the page afterwards is in self.page."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "docs").mkdir()
            (root / "docs" / "page.md").write_text(page)
            (root / "facts.json").write_text('{"a b, c": {"work": 4321}}')
            (root / "claims.json").write_text(json.dumps([dict(CLAIM, **claim) for claim in claims]))
            (root / "cairn").write_text(COMMAND)
            (root / "cairn").chmod(0o755)
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                code = check_docs.main(["--root", folder, "--claims", str(root / "claims.json"),
                                        "--cairn", str(root / "cairn"), *options])
            self.page = (root / "docs" / "page.md").read_text()
        return code, printed.getvalue()

    def expect(self, code, page, *claims):
        found, words = self.check(page, claims)
        self.assertEqual(found, code, words)
        return words

    def test_what_is_right_passes(self):
        self.expect(0, "the chain opens\nby 1.23 mm.", {"text": "chain opens by # mm."})
        self.expect(0, "opens by 1.2 mm.", {"text": "opens by # mm."})  # half of its last digit
        self.expect(0, "| a | 4 ms | 1.23 | 2e-6 |\n", {"text": "| a | * | # | # |\n", "values": [
            "/error/gap_m mm", "/error/depth_m mm"], "command": "run chain"})

    def test_what_is_off_is_named(self):
        words = self.expect(1, "opens by 1.25 mm.", {"text": "opens by # mm."})
        self.assertIn("docs/page.md: says 1.25, `cairn run chain` says 1.23: opens by # mm.", words)
        self.expect(0, "opens by 1.25 mm.", {"text": "opens by # mm.", "noise": 0.02})

    def test_a_text_that_is_gone_or_stands_there_twice_fails(self):
        self.assertIn("stands there 0 times", self.expect(1, "closes by 1.23 mm.", {"text": "opens by # mm."}))
        twice = "## One\n\nby 1.23 mm.\n\n## Two\n\nby 1.23 mm.\n"
        self.assertIn("stands there 2 times", self.expect(1, twice, {"text": "by # mm."}))
        self.expect(0, twice, {"text": "by # mm.", "under": "## Two"})

    def test_what_falls_and_its_flags(self):
        falls = {"text": "| # |\n", "value": "/error/fall_m mm", "falls": 500, "flags": {"energy": "E"}}
        self.expect(0, "| falls E |\n", falls)
        self.assertIn("says falls E", self.expect(1, "| 3.5 E |\n", falls))
        self.assertIn("says 1.23 E", self.expect(1, "| 1.23 |\n", {"text": "| # |\n", "flags": {"energy": "E"}}))

    def test_one_claim_of_many_words(self):
        each = {"text": "| {name} | # |", "for": {"name": ["a", "b"]}, "command": "run {name}"}
        self.assertIn("2 numbers by 2 commands, 0 off", self.expect(0, "| a | 1.23 |\n| b | 1.23 |\n", each))

    def test_files_are_looked_up_as_commands_are(self):
        self.expect(0, "4.3 thousand", {"text": "# thousand", "command": "facts.json", "value": "/a b, c/work k"})

    def test_numbers_are_mended_as_they_are_written(self):
        code, _ = self.check("by 1.50 mm and .9 mm and 5e-6.", [
            {"text": "by # mm and # mm and #.", "values": ["/error/gap_m mm", "/error/gap_m", "/error/depth_m mm"]}],
            "--fix")
        self.assertEqual(code, 1)
        self.assertEqual(self.page, "by 1.2 mm and .001 mm and 2e-6.")

    def test_slow_ones_are_for_who_asks(self):
        slow = [{"text": "by # mm.", "slow": True}]
        self.assertEqual(self.check("by 9 mm.", slow)[0], 0)
        self.assertEqual(self.check("by 9 mm.", slow, "--all")[0], 1)

    def test_files_that_pages_name_are_there(self):
        self.assertIn("docs/page.md: engine/gone.cpp is not there", self.expect(1, "`engine/gone.cpp`, `docs/page.md`"))


if __name__ == "__main__":
    unittest.main()

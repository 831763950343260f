#!/usr/bin/env python3
"""Pages of results: a part is replaced in its place, others stay, and a program that prints other lines ends the writer."""
import argparse
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bench"))

import results  # noqa: E402


class Pages(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        (self.root / "docs/results").mkdir(parents=True)
        self.page = self.root / "docs/results/page.md"

    def write(self, *words):
        """Writes the page of two parts, as `bench/NAME WORDS` would."""
        self.measured = []

        def measure(name):
            self.measured.append(name)
            return results.table(["figure"], [[len(self.measured)]])

        parts = {name: results.Part(name.capitalize(), lambda _, name=name: measure(name)) for name in ("first", "second")}
        with mock.patch.object(results, "ROOT", self.root), mock.patch.object(sys, "argv", ["bench/name", *words]), \
                mock.patch.object(results, "head", lambda title, command, timed: f"# {title}\n\nWritten by `{command}`.\n"), \
                mock.patch("builtins.print"):
            results.write("page.md", "The page", "Introduction.", parts, argparse.ArgumentParser(parents=[self.options()]))

    @staticmethod
    def options():
        parser = argparse.ArgumentParser(add_help=False)
        parser.add_argument("-w", action="store_true")
        return parser

    def headings(self):
        return list(results.sections_of(self.page.read_text(encoding="utf-8")))

    def test_parts_stand_in_the_order_of_the_writer_whatever_is_measured_first(self):
        self.write("-w", "second")
        self.assertEqual(self.headings(), ["", "Second"])
        self.write("-w", "first")
        self.assertEqual(self.measured, ["first"])
        self.assertEqual(self.headings(), ["", "First", "Second"])
        self.assertIn("Written by `bench/name -w second`", self.page.read_text(encoding="utf-8"))

    def test_nothing_by_hand_survives(self):
        self.page.write_text("# Old\n\nBy hand.\n\n## Second\n\nkept\n\n## By hand\n\nlost\n", encoding="utf-8")
        self.write("-w", "first")
        text = self.page.read_text(encoding="utf-8")
        self.assertEqual(self.headings(), ["", "First", "Second"])
        self.assertIn("kept", text)
        self.assertNotIn("hand", text)

    def test_without_w_no_page_is_written(self):
        self.write()
        self.assertEqual(self.measured, ["first", "second"])
        self.assertFalse(self.page.exists())

    def test_an_unknown_part_is_refused(self):
        with mock.patch.object(sys, "stderr"), self.assertRaises(SystemExit):
            self.write("third")

    def test_a_section_is_replaced_in_its_place_or_added_at_the_end(self):
        self.page.write_text("# Page\n\n## One\n\n1\n\n### Part\n\n## Two\n\n2\n", encoding="utf-8")
        results.put_section(self.page, "# One\n\nnew\n")
        results.put_section(self.page, "# Three\n\n3\n")
        self.assertEqual(self.page.read_text(encoding="utf-8"), "# Page\n\n## One\n\nnew\n\n## Two\n\n2\n\n## Three\n\n3\n")

    def test_a_program_that_prints_other_lines_ends_the_writer(self):
        self.assertEqual(results.figures("a 1 mm\na 2 mm\n", r"a (\d) mm"), [("1",), ("2",)])
        with self.assertRaises(SystemExit):
            results.figures("b 1 mm\n", r"a (\d) mm")

    def test_a_program_that_fails_ends_the_writer(self):
        with self.assertRaises(SystemExit):
            results.output_of("false")
        self.assertEqual(results.output_of("false", may_fail=True), "")


if __name__ == "__main__":
    unittest.main()

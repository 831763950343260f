#!/usr/bin/env python3
"""Pages of results: a part is replaced in its place, others stay; figures are readable; and a program that prints other lines ends the
writer."""
import argparse
import io
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

    def write(self, *words, names=("first", "second")):
        """Writes the page of these parts, as `bench/NAME WORDS` would."""
        self.measured = []

        def measure(name):
            self.measured.append(name)
            return results.table(["figure"], [[len(self.measured)], ["2.5e+04"]])

        parts = {name: results.Part(name.capitalize(), lambda _, name=name: measure(name)) for name in names}
        with mock.patch.object(results, "ROOT", self.root), mock.patch.object(sys, "argv", ["bench/name", *words]), \
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

    def test_each_section_has_a_head_of_its_own(self):
        self.write("-w")
        text = self.page.read_text(encoding="utf-8")
        for name in ("first", "second"):
            self.assertIn(f"Written by `bench/name -w {name}`. Do not edit this section; measure again.", text)
        self.assertEqual(text.count("| commit | unknown |"), 2, "the folder is no repository")
        self.assertEqual(text.count("| machine | any: the figures do not depend on it |"), 2)

    def test_a_page_of_one_part_has_no_sections(self):
        self.page.write_text("# Old\n\n## Section\n", encoding="utf-8")
        self.write("-w", names=[""])
        text = self.page.read_text(encoding="utf-8")
        self.assertTrue(text.startswith("# The page\n\nWritten by `bench/name -w`. Do not edit this page; measure again.\n\n| | |"))
        self.assertTrue(text.endswith("\n\nIntroduction.\n\n| figure |\n|---|\n| 1 |\n| 25,000 |\n"), text)
        self.assertNotIn("## ", text)

    def test_figures_that_depend_on_the_machine_name_it_and_its_load(self):
        for load, words in ((0.1, "| other work on the machine | no |"), (7, "yes: load 7.00 on 4 cores when the measurement began")):
            with mock.patch("os.getloadavg", lambda load=load: (load, 0, 0)), mock.patch("os.cpu_count", lambda: 4):
                self.assertIn(words, results.head("Title", "command"))
                self.assertNotIn("load", results.head("Title", "command", timed=False))

    def test_the_command_has_the_options_that_were_given_and_no_path(self):
        parser = results.parser_of("Usage: name")
        parser.add_argument("--hours", type=float, default=24)
        parser.add_argument("--judge", default="")
        parser.add_argument("--rivals", action="store_true")
        words = ["-w", "-b", "/tmp/build", "--data", "/tmp/data", "--hours", "2", "--judge=--small --jobs 1", "--rivals"]
        self.assertEqual(results.command_of("bench/name", "part", parser.parse_args(words), parser),
                         "bench/name -w part --data DATA --hours 2 --judge='--small --jobs 1' --rivals")
        self.assertEqual(results.command_of("bench/name", "", parser.parse_args(["-w"]), parser), "bench/name -w")

    def test_programs_in_other_languages_get_head_and_readable_tables(self):
        def printed(*words):
            out = io.StringIO()
            with mock.patch.object(sys, "argv", ["bench/results.py", *words]), mock.patch.object(sys, "stdout", out), \
                    mock.patch.object(sys, "stdin", io.StringIO("| 1.5e+05 |\n")):
                results.main()
            return out.getvalue()

        self.assertTrue(printed("head", "Title", "scripts/name").startswith("# Title\n\nWritten by `scripts/name`."))
        self.assertEqual(printed("readable"), "| 150,000 |\n")
        with self.assertRaises(SystemExit):
            printed("Title")

    def test_numbers_have_no_exponents(self):
        expected = {73512: "73,500", 7355: "7,360", 999.7: "1,000", 12.3: "12.3", 0.5: "0.5", 0: "0", -20720: "-20,700", 1.234e-5: "0.0000123",
                    1e-9: "1e-09", 9.996: "10"}
        for value, text in expected.items():
            self.assertEqual(results.number(value), text)
        self.assertEqual(results.number(1234567, 5), "1,234,600")

    def test_readable_tables_keep_names_hashes_and_code(self):
        for text in ("| 7e51e6b357d58e26 | `1e+05 at 10000` | 2019-11-26_16h29 | 9999 |", "of 20000 robots"):
            self.assertEqual(results.readable(text), text)
        self.assertEqual(results.readable("| 30359 +-1.7e+02 | 108227.5 | 1.0201e+05 (3 %) |"), "| 30,359 +-170 | 108,227.5 | 102,010 (3 %) |")

    def test_a_mean_has_its_standard_error(self):
        self.assertEqual(results.mean_and_error([9, 11]), "10.0 +- 1.0")
        self.assertEqual(results.mean_and_error([152.31, 152.35, 152.33]), "152.330 +- 0.012")
        self.assertEqual(results.mean_and_error([3]), "3 +- 0")

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

"""scripts/prose: what it counts, what it leaves out, what it complains of."""
import importlib.machinery
import importlib.util
import pathlib
import subprocess
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "prose"


def load():
    loader = importlib.machinery.SourceFileLoader("prose", str(SCRIPT))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("prose", loader))
    loader.exec_module(module)
    return module


prose = load()


def lengths(text):
    return [len(words) for _, words in prose.sentences(text)]


def run(text):
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "page.md"
        page.write_text(text, encoding="utf-8")
        return subprocess.run([SCRIPT, page], capture_output=True, text=True, check=False)


class Sentences(unittest.TestCase):
    def test_are_counted_by_words(self):
        self.assertEqual(lengths("One two three. Four five?\nSix!"), [3, 2, 1])

    def test_reach_over_lines_and_keep_the_line_on_which_they_begin(self):
        found = [(line, len(words)) for line, words in prose.sentences("# Title\n\nOne two.\nThree\nfour five. Six.\n")]
        self.assertEqual(found, [(3, 2), (4, 3), (5, 1)])

    def test_end_with_their_block(self):
        self.assertEqual(lengths("One two\n\nthree four five"), [2, 3])

    def test_list_items_are_sentences_of_their_own(self):
        self.assertEqual(lengths("- one two\n- three\n  four five\n1. six\n"), [2, 3, 1])

    def test_abbreviations_and_initials_do_not_end_one(self):
        self.assertEqual(lengths("Effects, e.g. of a battery, by J. Doe et al. are few, i.e. two."), [14])

    def test_decimal_numbers_and_file_names_do_not_end_one(self):
        self.assertEqual(lengths("It is 3.5 mm as README.md says."), [7])

    def test_an_ellipsis_does_not_end_one(self):
        self.assertEqual(lengths("It goes ... on and on."), [5])

    def test_quotes_and_brackets_may_close_one(self):
        self.assertEqual(lengths('He said "stop." (Then he left.) Nobody moved.'), [3, 3, 2])


class CommentsOfSources(unittest.TestCase):
    SOURCE = ("/// One two three: four; five.\n///   a layout line\n// six seven\nint x = 0;  // one two three\n"
              "           // four\nconst char* address = \"http: // not counted\";\n#include <x>\n  // eight nine ten.\n")

    def test_are_counted_line_by_line(self):
        found = [(line, len(words)) for line, words in prose.sentences(prose.comments(self.SOURCE), ".!?:;")]
        self.assertEqual(found, [(1, 3), (1, 1), (1, 1), (3, 2), (4, 4), (8, 3)])

    def test_of_scripts_begin_with_a_hash(self):
        text = "# One two.\nx = 1  # three four five\ny = '# not counted'\n"
        self.assertEqual([len(words) for _, words in prose.sentences(prose.comments(text, "#"))], [2, 3])

    def test_have_short_sentences(self):
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "source.hpp"
            source.write_text("// " + "word " * 31 + ".\n", encoding="utf-8")
            outcome = subprocess.run([SCRIPT, source], capture_output=True, text=True, check=False)
        self.assertEqual(outcome.returncode, 1)
        self.assertIn("source.hpp:1: a sentence of 31 words", outcome.stdout)


class HeadlessSentences(unittest.TestCase):
    def test_begin_with_a_relative_clause_and_are_no_questions(self):
        for text, is_headless in (("What is found is tried.", True), ("Whoever comes later waits.", True),
                                  ("What is found?", False), ("The robot that comes later waits.", False)):
            self.assertEqual(run(f"{text}\n").returncode, int(is_headless), text)

    def test_are_found_in_comments_of_scripts_and_behind_code(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in (("a.cpp", "int x;  // What it holds.\n"), ("b.sh", "# Who may call it.\n"),
                               ("c", "#!/bin/sh\n# Which one acts.\n")):
                source = pathlib.Path(folder) / name
                source.write_text(text, encoding="utf-8")
                outcome = subprocess.run([SCRIPT, source], capture_output=True, text=True, check=False)
                self.assertEqual(outcome.returncode, 1, name)
                self.assertIn("begin with a noun", outcome.stdout)


class LeftOut(unittest.TestCase):
    def test_fenced_code(self):
        self.assertEqual(lengths("One.\n```c\nint not; counted. At all.\n```\nTwo three.\n"), [1, 2])

    def test_fences_of_tildes_and_fences_within_longer_fences(self):
        self.assertEqual(lengths("~~~\na b c\n~~~\n````\n```\nx y z\n```\n````\nOne.\n"), [1])

    def test_fenced_code_within_a_list_item(self):
        self.assertEqual(lengths("1. One two.\n   ```\n   not counted\n   ```\n   Three.\n"), [2, 1])

    def test_indented_code(self):
        self.assertEqual(lengths("One:\n\n    not counted\n\n    nor this one\n\nTwo three.\n"), [1, 2])

    def test_indented_code_within_a_list_item(self):
        self.assertEqual(lengths("1. One two.\n\n       not counted\n\n   Three four five.\n"), [2, 3])

    def test_a_second_paragraph_of_a_list_item_is_no_code(self):
        self.assertEqual(lengths("- One two.\n\n  Three four five.\n"), [2, 3])

    def test_tables_headings_rules_comments_and_pictures(self):
        self.assertEqual(lengths("# A heading\n\n| a | b |\n|---|---|\n| c | d |\n\n---\n<!-- not\ncounted -->\n"
                                 "![a picture of robots](a.svg)\n\nOne.\n"), [1])

    def test_tags(self):
        self.assertEqual(lengths('- <a id="two-words"></a>**term**: what it is.'), [4])

    def test_link_targets(self):
        self.assertEqual(lengths("See [the two words](docs/very/long.md#and-more) there."), [5])

    def test_code_spans_formulas_and_addresses_are_one_word_each(self):
        self.assertEqual(lengths("Type `kilotwin run x.txtpb --seed 1` for $a + b$ from https://a.org/b. Done."), [6, 1])


class Verdicts(unittest.TestCase):
    def test_a_good_page_passes(self):
        result = run("# Page\n\nShort sentences are easy to read. They have one idea.\n")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertIn("mean   5.0, longest   6 (line 3), 2 sentences", result.stdout)

    def test_a_long_sentence_is_found_with_its_line(self):
        result = run("Short.\n\nShort. Another. One more.\n" + "word " * 30 + "end.\n")
        self.assertEqual(result.returncode, 1)
        self.assertIn("page.md:4: a sentence of 31 words, at most 30", result.stdout)

    def test_thirty_words_are_few_enough(self):
        self.assertEqual(run("Short. Short. Short.\n" + "word " * 29 + "end.\n").returncode, 0)

    def test_a_high_mean_is_found(self):
        result = run(("word " * 18 + "end. ") * 3)
        self.assertEqual(result.returncode, 1)
        self.assertIn("19.0 words per sentence on average", result.stdout)

    def test_words_with_a_better_one_are_found_in_text_and_not_in_code(self):
        self.assertEqual(run("The `roster` is code.\n\n```\nledger\n```\n").returncode, 0)
        result = run("It is short.\nThe Roster is long.\n")
        self.assertEqual(result.returncode, 1)
        self.assertIn('page.md:2: "Roster"; write: membership', result.stdout)

    def test_the_random_seed_may_be_named(self):
        self.assertEqual(run("Choose the seed of the run. The same seed gives the same run.\n").returncode, 0)
        self.assertEqual(run("These are the seed's grids.\n").returncode, 1)

    def test_a_page_that_is_not_there_is_an_error(self):
        result = subprocess.run([SCRIPT, "/nowhere.md"], capture_output=True, text=True, check=False)
        self.assertEqual((result.returncode, result.stdout), (2, ""))


if __name__ == "__main__":
    unittest.main()

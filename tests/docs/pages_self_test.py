"""pages_test.py finds what is wrong with a page."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().with_name("pages_test.py")
KILOTWIN = os.environ["KILOTWIN"]


def verdict(what, text, *more_arguments):
    """Exit status and complaints."""
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "page.md"
        page.write_text(text, encoding="utf-8")
        result = subprocess.run([sys.executable, SCRIPT, what, *more_arguments, page], capture_output=True, text=True,
                                check=False)
        return result.returncode, result.stderr


def run(text):
    return verdict("run", text, "--kilotwin", KILOTWIN)


class Run(unittest.TestCase):
    def test_commands_run_in_order_in_one_shell_among_the_written_files(self):
        status, complaints = run("```text file=a.txt\nhello\n```\n```sh run\nmkdir b\ncd b\n```\n"
                                 "1. In a list:\n\n   ```sh run\n   test -f ../a.txt\n   ```\n<!-- run: test ! -f a.txt -->\n")
        self.assertEqual(status, 0, complaints)

    def test_a_command_that_fails_is_told_with_its_line(self):
        status, complaints = run("# Page\n\n```sh run\ntrue\n```\n\n```sh run\nfalse\n```\n")
        self.assertEqual(status, 1)
        self.assertIn("page.md:7\n", complaints.splitlines(keepends=True)[-2])

    def test_a_hidden_command_that_fails_counts(self):
        self.assertEqual(run("<!-- run: false -->\n")[0], 1)

    def test_commands_without_the_word_run_are_shown_only(self):
        self.assertEqual(run("```sh\nfalse\n```\n")[0], 0)

    def test_a_mistyped_word_is_no_way_out(self):
        status, complaints = run("```sh runn\nfalse\n```\n")
        self.assertEqual(status, 1)
        self.assertIn("unknown word runn", complaints)

    def test_an_experiment_that_is_shown_must_be_right(self):
        page = "```txtpb file=x.txtpb\nrobots { count: 3 behaviour: \"behaviours/blink.c\" }\narena { FIELD: 900 }\n```\n"
        self.assertEqual(run(page.replace("FIELD", "width_mm"))[0], 0)
        status, complaints = run(page.replace("FIELD", "widht_mm"))
        self.assertEqual(status, 1)
        self.assertIn("unknown field widht_mm", complaints)

    def test_a_program_that_is_shown_must_compile(self):
        page = "```c file=x.c\n#include <kilolib.h>\nint main(void) { kilo_init(); return CALL; }\n```\n"
        self.assertEqual(run(page.replace("CALL", "0"))[0], 0)
        self.assertEqual(run(page.replace("CALL", "kilo_no_such(1"))[0], 1)

    def test_a_part_of_an_experiment_within_a_sentence_must_be_right(self):
        self.assertEqual(run("Set `arena { width_mm: 900 }`, or `radio { ... }`.\n")[0], 0)
        self.assertEqual(run("Set `arena { width_mm: -900 }`.\n")[0], 1)


class Links(unittest.TestCase):
    def test_files_and_headings_must_be_there(self):
        self.assertEqual(verdict("links", "# A heading\n[a](#a-heading) [b](page.md) [c](https://example.org/x)\n")[0], 0)
        self.assertEqual(verdict("links", "[a](nowhere.md)\n")[0], 1)
        status, complaints = verdict("links", "# A heading\n\n[a](#another-heading)\n")
        self.assertEqual(status, 1)
        self.assertIn("page.md:3: #another-heading: no such heading", complaints)

    def test_code_has_no_links(self):
        self.assertEqual(verdict("links", "`[a](nowhere.md)`\n```\n[b](nowhere.md)\n```\n")[0], 0)


class Options(unittest.TestCase):
    def test_options_must_exist(self):
        def options(text):
            return verdict("options", text, "--kilotwin", KILOTWIN)[0]

        self.assertEqual(options("Type `kilotwin run x.txtpb --seed 3`, or `--seed 3` with another.\n"), 0)
        self.assertEqual(options("Type `kilotwin run x.txtpb --seeds 3`.\n"), 1)
        self.assertEqual(options("```sh\nkilotwin export runs/x --seed 3\n```\n"), 1)
        self.assertEqual(options("Use `--no-such-option`.\n"), 1)
        self.assertEqual(options("Type `kilotwin fly`.\n"), 1)


if __name__ == "__main__":
    unittest.main()

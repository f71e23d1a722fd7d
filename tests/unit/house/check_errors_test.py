#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""check_errors.py finds a message that no test asserts, and an exception that nothing needs any more."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import check_errors

THROW = 'void f(int n) {\n  throw Error(ErrorKind::data, "leg",\n              "has " + std::to_string(n) +\n' \
        '                  " knees too many", "count again");\n}\n'


class CheckErrors(unittest.TestCase):
    def missing(self, code, test, exceptions=None):
        with tempfile.TemporaryDirectory() as name:
            source = pathlib.Path(name)
            for folder in (*check_errors.FOLDERS, "tests"):
                (source / folder).mkdir(parents=True)
            (source / "io/leg.cpp").write_text(code)
            (source / "tests/leg_test.py").write_text(test)
            kept, check_errors.EXCEPTIONS = check_errors.EXCEPTIONS, exceptions or {}
            try:
                return check_errors.missing(source)[0]
            finally:
                check_errors.EXCEPTIONS = kept

    def test_a_message_must_be_asserted(self):
        self.assertEqual(self.missing(THROW, 'x = "has 3 knees too many"'), [])
        self.assertEqual(self.missing(THROW, 'x = "knees too"'), [])
        self.assertEqual(self.missing(THROW, 'x = "toes too many"'), ["io/leg.cpp:2: leg ... has  ...  knees too many ... count again"])
        self.assertEqual(len(self.missing(THROW, '# "has 3 knees too many"')), 1)
        self.assertEqual(len(self.missing(THROW, '"""It has 3 knees too many."""')), 1)

    def test_one_literal_asserts_one_message(self):
        twice = THROW + THROW.replace("leg", "arm").replace("knees", "elbows")
        self.assertEqual(self.missing(twice, 'x = ["3 knees too many", "3 elbows too many"]'), [])
        self.assertEqual(self.missing(twice, 'x = "3 knees too many"'), ["io/leg.cpp:7: arm ... has  ...  elbows too many ... count again"])
        same = THROW + THROW  # the same words at two places
        self.assertEqual(len(self.missing(same, 'x = "3 knees too many"')), 1)
        self.assertEqual(self.missing(same, 'x = ["3 knees too many", "9 knees too many"]'), [])
        self.assertEqual(len(self.missing(THROW, 'x = "too many"')), 1)  # fewer letters than tell

    def test_options_are_no_message(self):
        usage = 'void f() {\n  usage("--threads-of-mine", "none", "give one"); }'
        self.assertEqual(len(self.missing(usage, 'x = "--threads-of-mine"')), 1)

    def test_what_a_function_says_around_its_words(self):
        unknown = 'void f() {\n  value.fail_unknown("joint", name, known); }'
        self.assertEqual(self.missing(unknown, """x = "unknown joint 'knee'" """), [])
        self.assertEqual(len(self.missing(unknown, 'x = "joint: knee"')), 1)

    def test_comments_and_callers_words_do_not_count(self):
        self.assertEqual(self.missing("// " + THROW.replace("\n", " "), ""), [])
        self.assertEqual(self.missing('void f() { throw Error(kind, where, what, "count again"); }', ""), [])

    def test_exceptions_are_needed(self):
        excuse = {"io/leg.cpp": {"knees too many": "no leg has them"}}
        self.assertEqual(self.missing(THROW, "", excuse), [])
        self.assertEqual(self.missing("", "", excuse), ["io/leg.cpp: no message says 'knees too many' any more: take the exception out"])


if __name__ == "__main__":
    unittest.main()

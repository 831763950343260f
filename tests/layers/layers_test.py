"""layers.py on small trees: it reports each kind of fault at its place, and nothing where there is none."""
import os
import sys
import tempfile
import unittest

import layers

TABLE = """# A project

## Layers

| folder or files | purpose | may include |
|---|---|---|
| `core/base` | basics | |
| `core/plan` | plans | `core/base` `pb` |
| `services/radio` | an engine | `core/*` |
| `services/radio/radio_service.*` | its federate | `services/radio` |

| files | never include |
|---|---|
| `{core/plan,services}/*.hpp` | `pb` |
| `core/*` | `<Eigen/*>` |

## Another section

| `core/base` | not of the table | `core/plan` |
"""

SOURCES = {
    "core/base/ids.hpp": "#include <cstdint>\n",
    "core/plan/plan.hpp": '#include "core/base/ids.hpp"\n',
    "core/plan/plan.cpp": '#include "core/plan/plan.hpp"\n#include "idl/manifest.pb.h"\n',
    "services/radio/engine.hpp": '#include "core/plan/plan.hpp"\n',
    "services/radio/radio_service.cpp": '#include "services/radio/engine.hpp"\n',
}


class Layers(unittest.TestCase):
    def findings(self, **changes):
        """Of the tree above with some files changed; a name is that of a path, with __ for / and _dot_ for the point."""
        with tempfile.TemporaryDirectory() as root:
            files = dict(SOURCES, **{"ARCHITECTURE.md": TABLE})
            files.update({name.replace("__", "/").replace("_dot_", "."): text for name, text in changes.items()})
            for name, text in files.items():
                path = os.path.join(root, name)
                os.makedirs(os.path.dirname(path), exist_ok=True)
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
            return layers.check(root, layers.Table(os.path.join(root, "ARCHITECTURE.md")))

    def test_a_tree_that_keeps_to_the_table_has_no_findings(self):
        self.assertEqual(self.findings(), [])

    def test_a_forbidden_include_is_reported_with_file_line_and_the_allowed_folders(self):
        self.assertEqual(
            self.findings(core__plan__plan_dot_hpp='#include "core/base/ids.hpp"\n\n#include "services/radio/engine.hpp"\n')[0],
            "core/plan/plan.hpp:3: core/plan may not include services/radio/engine.hpp of services/radio; "
            "it may include core/base pb")
        self.assertEqual(self.findings(core__base__ids_dot_hpp='#  include "core/plan/plan.hpp"\n')[0],
                         "core/base/ids.hpp:1: core/base may not include core/plan/plan.hpp of core/plan; "
                         "it may include nothing")

    def test_an_engine_may_not_include_its_service(self):
        found = self.findings(services__radio__radio_service_dot_hpp="",
                              services__radio__engine_dot_cpp='#include "services/radio/radio_service.hpp"\n')
        self.assertIn("services/radio/engine.cpp:1: services/radio may not include services/radio/radio_service.hpp of "
                      "services/radio/radio_service.*; it may include core/*", found)

    def test_the_schema_is_refused_in_headers_and_a_library_where_the_table_says_so(self):
        found = self.findings(core__plan__plan_dot_hpp='#include "core/base/ids.hpp"\n#include "idl/manifest.pb.h"\n'
                              "#include <Eigen/Core>\n")
        self.assertEqual(found, ["core/plan/plan.hpp:2: {core/plan,services}/*.hpp may never include pb, here idl/manifest.pb.h",
                                 "core/plan/plan.hpp:3: core/* may never include <Eigen/*>, here <Eigen/Core>"])

    def test_a_circle_of_folders_is_reported_with_the_includes_that_close_it(self):
        found = self.findings(ARCHITECTURE_dot_md=TABLE.replace("| basics | |", "| basics | `core/plan` |"),
                              core__base__error_dot_cpp='#include "core/plan/plan.hpp"\n')
        self.assertEqual(found, ["folders include each other in a circle: core/base -> core/plan (core/base/error.cpp:1), "
                                 "core/plan -> core/base (core/plan/plan.hpp:1)"])

    def test_a_circle_of_two_sources_of_one_folder_is_reported(self):
        found = self.findings(core__plan__layout_dot_hpp="", core__plan__layout_dot_cpp='#include "core/plan/check.hpp"\n',
                              core__plan__check_dot_hpp="", core__plan__check_dot_cpp='#include "core/plan/layout.hpp"\n')
        self.assertEqual(found, ["sources include each other in a circle: core/plan/check -> core/plan/layout "
                                 "(core/plan/check.cpp:1), core/plan/layout -> core/plan/check (core/plan/layout.cpp:1)"])

    def test_an_entry_that_nothing_uses_and_a_file_without_a_row_are_reported(self):
        found = self.findings(core__plan__plan_dot_cpp="", core__new__a_dot_cpp='#include "core/base/ids.hpp"\n')
        self.assertEqual(found, ["core/new/a.cpp:1: ARCHITECTURE.md has no row for this file",
                                 "ARCHITECTURE.md:8: nothing of core/plan includes pb; remove it"])


if __name__ == "__main__":
    sys.exit(unittest.main())

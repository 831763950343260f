// Tables in their formats; NumPy and pandas read what was written, where they are installed.
#include "clients/recorder/table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include "clients/recorder/npz_table.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"

namespace kilotwin::recorder {
namespace {

namespace fs = std::filesystem;

class TableTest : public testing::Test {
 protected:
  TableTest() {
    std::string name = (fs::temp_directory_path() / "kilotwin-table-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~TableTest() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name) {
    const fs::path file = folder_ / name;
    const auto table = open_table(file,
                                  {{"time_s", "s", CellType::kTime},
                                   {"robot", "", CellType::kInteger},
                                   {"hops", "", CellType::kInteger},
                                   {"x_mm", "mm", CellType::kNumber, 4},
                                   {"state", "", CellType::kText}},
                                  {{"seed", "7"}, {"version", "1, \"two\""}});
    const TickLength length{262144};
    for (int i = 0; i < 3; ++i) {
      table->time(Tick{i}, length);
      table->integer(i);
      if (i == 1)
        table->missing();
      else
        table->integer(10 * i);
      if (i == 2)
        table->missing();
      else
        table->number(-1.25 * i);
      table->text(i == 0 ? "running" : i == 1 ? "a \"b\", Käfer 🐞" : "");
      table->end_row();
    }
    table->close();
    EXPECT_EQ(table->rows(), 3u);
    return file;
  }

  /// Runs Python; skips the test where it or a module is missing.
  void python(const std::string& modules, const std::string& text) {
    // Debian's NumPy is for Debian's Python, which need not be the first on the PATH.
    const fs::path python3 = fs::exists("/usr/bin/python3") ? "/usr/bin/python3" : os::find_executable("python3");
    if (python3.empty() || !os::run_process({python3, "-c", "import " + modules}).end.well())
      GTEST_SKIP() << "python3 with " << modules << " is not installed";
    const os::ProcessResult result = os::run_process({python3, "-c", text, folder_});
    EXPECT_TRUE(result.end.well()) << result.errors;
  }

  fs::path folder_;
};

TEST_F(TableTest, CsvIsAsBefore) {
  EXPECT_EQ(os::read_file(write("t.csv")),
            "time_s,robot,hops,x_mm,state\n0,0,0,0.0000,running\n0.032768,1,,-1.2500,\"a \"\"b\"\", Käfer 🐞\"\n"
            "0.065536,2,20,,\n");
  EXPECT_NE(os::read_file(folder_ / "t.csv.json").find("\"unit\": \"mm\""), std::string::npos);
}

TEST_F(TableTest, EqualTablesGiveEqualFiles) {
  for (const std::string ending : {".npz", ".arrow"}) {
    const std::string first = os::read_file(write("a" + ending));
    EXPECT_EQ(first, os::read_file(write("b" + ending)));
  }
}

TEST_F(TableTest, OtherEndingsAreRefused) {
  EXPECT_THROW(static_cast<void>(open_table(folder_ / "t.xls", {{"a", ""}}, {})), UserError);
  EXPECT_THROW(static_cast<void>(open_table(folder_ / "none/t.npz", {{"a", ""}}, {})), RunError);
}

TEST_F(TableTest, NumPyReadsTheArchive) {
  write("t.npz");
  python("numpy", R"(
import json, sys, zipfile, numpy as np
name = sys.argv[1] + "/t.npz"
assert zipfile.ZipFile(name).testzip() is None
t = np.load(name)
assert t.files == ["time_s", "robot", "hops", "x_mm", "state"], t.files
assert t["robot"].dtype == np.int64 and list(t["robot"]) == [0, 1, 2]
assert t["hops"].dtype == np.float64 and t["hops"][0] == 0 and np.isnan(t["hops"][1]) and t["hops"][2] == 20
assert t["time_s"][2] == 0.065536
assert t["x_mm"][1] == -1.25 and np.isnan(t["x_mm"][2])
assert list(t["state"]) == ["running", 'a "b", K\u00e4fer \U0001F41E', ""], t["state"]
about = json.loads(zipfile.ZipFile(name).comment)
assert about["seed"] == "7" and about["version"] == '1, "two"' and about["columns"][3]["unit"] == "mm"
)");
}

TEST_F(TableTest, CellsThatWaitInFilesGiveTheSameArchive) {
  const auto write = [&](const std::string& name, std::size_t most_waiting) {
    NpzTable table(folder_ / name,
                   {{"small", "", CellType::kInteger},
                    {"wide", "", CellType::kInteger},
                    {"gaps", "", CellType::kInteger},
                    {"x_mm", "mm", CellType::kNumber},
                    {"word", "", CellType::kText}},
                   {}, most_waiting);
    for (std::int64_t i = 0; i < 30'000; ++i) {
      table.integer(i / 10'000 - 1);
      table.integer(i % 2 == 0 ? std::numeric_limits<std::int64_t>::max() - i : -5'000'000'000 * i);
      if (i % 3 == 0)
        table.missing();
      else
        table.integer(70'000 * i);
      table.number(std::sqrt(static_cast<double>(i)));
      if (i % 5 == 0)
        table.missing();
      else
        table.text("w" + std::to_string(i % 300));
      table.end_row();
    }
    table.close();
    return os::read_file(folder_ / name);
  };
  const std::string in_memory = write("memory.npz", std::size_t{1} << 30);
  EXPECT_EQ(write("file.npz", 0), in_memory);
  EXPECT_EQ(write("both.npz", 300'000), in_memory);
  python("numpy", R"(
import sys, numpy as np
t = np.load(sys.argv[1] + "/both.npz")
i = np.arange(30000)
assert (t["small"] == i // 10000 - 1).all()
assert (t["wide"] == np.where(i % 2 == 0, np.iinfo(np.int64).max - i, -5000000000 * i)).all()
assert np.array_equal(t["gaps"], np.where(i % 3 == 0, np.nan, 70000.0 * i), equal_nan=True)
assert (t["x_mm"] == np.sqrt(i)).all()
assert list(t["word"]) == ["" if n % 5 == 0 else f"w{n % 300}" for n in i]
)");
}

TEST_F(TableTest, AnArchiveOfManyColumnsStillNamesThem) {
  std::vector<Column> columns;
  for (int i = 0; i < 2000; ++i)
    columns.push_back({"variable_with_a_long_name_" + std::to_string(i), "mm", CellType::kInteger});
  for (const std::size_t longest : std::vector<std::size_t>{10, 70'000}) {
    const auto table = open_table(folder_ / ("wide-" + std::to_string(longest) + ".npz"), columns,
                                  {{"seed", "7"}, {"command_line", std::string(longest, 'x')}});
    for (int i = 0; i < 2000; ++i) table->integer(i);
    table->end_row();
    table->close();
  }
  python("numpy", R"(
import json, sys, zipfile, numpy as np
for longest in (10, 70000):
    name = f"{sys.argv[1]}/wide-{longest}.npz"
    archive = zipfile.ZipFile(name)
    about = json.loads(archive.comment)
    assert about["seed"] == "7" and len(about.get("command_line", "")) == (10 if longest == 10 else 0)
    units = {c["name"]: (c["unit"], c["type"]) for c in (json.loads(m.comment) for m in archive.infolist())}
    assert len(units) == 2000 and units["variable_with_a_long_name_7"] == ("mm", "integer")
    assert np.load(name)["variable_with_a_long_name_1999"][0] == 1999
)");
}

TEST_F(TableTest, ArrowsOwnReaderReadsTheFile) {
  write("t.arrow");
  const auto table =
      open_table(folder_ / "long.feather", {{"n", "", CellType::kInteger}, {"word", "", CellType::kText}}, {});
  for (int i = 0; i < 150'000; ++i) {
    if (i % 7 == 0)
      table->missing();
    else
      table->integer(-i);
    if (i % 11 == 0)
      table->missing();
    else
      table->text(std::to_string(i) + "\xff");  // no UTF-8
    table->end_row();
  }
  table->close();
  const fs::path node = os::find_executable("node");
  if (node.empty()) GTEST_SKIP() << "node is not installed";
  const os::ProcessResult result = os::run_process(
      {node, KILOTWIN_SOURCES "/tests/clients/recorder/arrow_test.mjs", folder_, KILOTWIN_SOURCES "/build/npm"});
  if (result.end.code == 77) GTEST_SKIP() << "build/npm has no apache-arrow; scripts/setup installs it";
  EXPECT_TRUE(result.end.well()) << result.errors;
}

TEST_F(TableTest, PandasReadsBothFormatsWithoutOptions) {
  write("t.npz");
  write("t.csv.gz");
  python("numpy, pandas", R"(
import sys, numpy as np, pandas as pd
a = pd.DataFrame(dict(np.load(sys.argv[1] + "/t.npz")))
b = pd.read_csv(sys.argv[1] + "/t.csv.gz")
assert list(a.columns) == list(b.columns)
for column in ["time_s", "robot", "hops", "x_mm"]:
    assert a[column].dtype == b[column].dtype, column
    assert np.allclose(a[column], b[column], equal_nan=True), column
assert list(a["state"]) == list(b["state"].fillna(""))
)");
}

}  // namespace
}  // namespace kilotwin::recorder

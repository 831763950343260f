#include <gtest/gtest.h>
#include <stdlib.h>
#include <zlib.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <random>

#include "core/base/error.hpp"
#include "core/csv/csv_reader.hpp"
#include "core/csv/csv_writer.hpp"

namespace kilotwin {
namespace {

using Table = std::vector<std::vector<std::string>>;

/// All rows, preceded by the header's names.
Table table_of(CsvReader reader) {
  Table table{reader.columns()};
  while (reader.next()) {
    table.emplace_back();
    for (std::size_t i = 0; i < reader.cells(); ++i) table.back().emplace_back(reader.text(i));
  }
  return table;
}

Table table_of(const std::string& content) { return table_of(CsvReader("t.csv", content)); }

std::string error_of(const std::string& content, const CsvLayout& layout = {}) {
  try {
    CsvReader reader("t.csv", content, layout);
    while (reader.next()) {}
  } catch (const UserError& error) {
    return error.what();
  }
  return {};
}

class Folder {
 public:
  Folder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "kilotwin-csv-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(CsvReader, ReadsPlainRows) {
  EXPECT_EQ(table_of("a,b\n1,2\n\n 3 ,\t4\n,\n5,6"),
            (Table{{"a", "b"}, {"1", "2"}, {"3", "4"}, {"", ""}, {"5", "6"}}));
  EXPECT_EQ(table_of("a,b\r\n1,2\r\n"), (Table{{"a", "b"}, {"1", "2"}}));
  EXPECT_EQ(table_of("\xef\xbb\xbf\n  \na\n1\n"), (Table{{"a"}, {"1"}})) << "byte order mark and blank lines";
  EXPECT_EQ(table_of("a\tb c\n1\t2,5\n\t\n"), (Table{{"a", "b c"}, {"1", "2,5"}, {"", ""}})) << "tabs";
}

TEST(CsvReader, ReadsQuotedCells) {
  EXPECT_EQ(table_of("\"a\",\"b \"\n\"1,\"\"x\"\"\",\"two\nlines\"\n3,4\n"),
            (Table{{"a", "b "}, {"1,\"x\"", "two\nlines"}, {"3", "4"}}));
  EXPECT_EQ(table_of("a,b\r\n \"1\" ,2\r\n\"\",\"\"\"\"\r\n"), (Table{{"a", "b"}, {"1", "2"}, {"", "\""}}));
  EXPECT_EQ(table_of("\"a,b\"\tc\n1\t2\n"), (Table{{"a,b", "c"}, {"1", "2"}}));
}

TEST(CsvReader, ErrorsNameFileLineAndColumn) {
  EXPECT_EQ(error_of(""), "t.csv:1:1: is empty; the first line names the columns");
  EXPECT_EQ(error_of("a,b\n1,2\n3\n"), "t.csv:3:2: the row has 1 cell; the header names 2");
  EXPECT_EQ(error_of("a,b\n1,2,3\n"), "t.csv:2:5: the row has 3 cells; the header names 2");
  EXPECT_EQ(error_of("a,b\n\"1\n2\",\"x\n"),
            "t.csv:3:4: the quoted cell has no end; close it with a quote, and write quotes within it twice");
  EXPECT_EQ(error_of("a,b\n1,2\"3\n"),
            "t.csv:2:4: a quote within a cell; quote the whole cell, and write the quote twice");
  EXPECT_EQ(error_of("a,b\n\"1\"2,3\n"),
            "t.csv:2:4: text after the closing quote; write a separator, or the quotes within the cell twice");
  EXPECT_EQ(error_of("a,b,a\n"), "t.csv:1:5: there are two columns \"a\"; name one of them otherwise");
  EXPECT_EQ(error_of("\xff\xfe"
                     "a\0"),
            "t.csv:1:1: is UTF-16; save it as UTF-8");
  CsvReader reader("t.csv", "a,b\n\n\"x\ny\", 1.5x\n");
  ASSERT_TRUE(reader.next());
  try {
    static_cast<void>(reader.number(1));
    FAIL();
  } catch (const UserError& error) {
    EXPECT_STREQ(error.what(), "t.csv:4:5: b is \"1.5x\"; give a number");
  }
}

TEST(CsvReader, NamesMissingAndExistingColumns) {
  const CsvReader reader("t.csv", "x,y\n1,2\n");
  try {
    reader.require({"run", "x", "time_s"}, "run,time_s,x");
    FAIL();
  } catch (const UserError& error) {
    EXPECT_STREQ(error.what(),
                 "t.csv:1:1: the columns run, time_s are missing, the header has x, y; write run,time_s,x");
  }
  EXPECT_NO_THROW(reader.require({"x", "y"}, "x,y"));
}

TEST(CsvReader, ParsesNumbers) {
  CsvReader reader("t.csv", "a,b,c,d,e\n-1.5e3,+2,4294967295,,nan\n1e999,0x10,-1,inf,1 2\n");
  ASSERT_TRUE(reader.next());
  EXPECT_EQ(reader.number(0), -1500);
  EXPECT_EQ(reader.number(1), 2);
  EXPECT_EQ(reader.whole(2), 4294967295u);
  EXPECT_TRUE(std::isnan(reader.number_or_nan(3)));
  EXPECT_TRUE(std::isnan(reader.number_or_nan(4)));
  ASSERT_TRUE(reader.next());
  for (std::size_t i = 0; i < 5; ++i) {
    if (i != 2) {
      EXPECT_THROW(static_cast<void>(reader.number(i)), UserError) << i;
    }
    EXPECT_THROW(static_cast<void>(reader.whole(i)), UserError) << i;
  }
}

TEST(CsvReader, ReadsMatricesWithoutHeader) {
  CsvReader reader("t.dat", " 1  2\t3 \n\n4 5\n", {' ', false, false});
  ASSERT_TRUE(reader.next());
  EXPECT_EQ(reader.cells(), 3u);
  EXPECT_EQ(reader.number(2), 3);
  ASSERT_TRUE(reader.next());
  EXPECT_EQ(reader.line(), 3u);
  EXPECT_EQ(reader.cells(), 2u);
  EXPECT_FALSE(reader.next());
  EXPECT_NE(error_of("1 2\n3\n", {' ', false, true}), "");
}

TEST(CsvReader, FilesThatCannotBeReadAreNamed) {
  const Folder folder;
  const auto error = [&](const std::filesystem::path& file) -> std::string {
    try {
      const CsvReader reader(file);
    } catch (const UserError& refusal) {
      return refusal.what();
    }
    return {};
  };
  EXPECT_EQ(error(folder / "none.csv"), (folder / "none.csv").string() + ": there is no such file");
  EXPECT_EQ(error(folder / ""), (folder / "").string() + ": is a directory; name a file");
}

std::string random_cell(std::mt19937_64& random) {
  constexpr std::string_view kCharacters = "ab19.,;\"\"\n\r\t  -";
  std::string cell;
  for (std::uint64_t i = random() % 6; i > 0; --i) cell += kCharacters[random() % kCharacters.size()];
  return cell;
}

TEST(Csv, ReadsBackAnyCellsThatWereWritten) {
  const Folder folder;
  std::mt19937_64 random(1);
  for (int round = 0; round < 400; ++round) {
    const std::size_t columns = 1 + random() % 4;
    Table table{{}};
    std::string header;
    for (std::size_t i = 0; i < columns; ++i) {
      table[0].push_back("name" + std::to_string(i) + random_cell(random) + "_");
      header += (i == 0 ? "" : ",") + csv_cell(table[0].back());
    }
    const auto file = folder / (round % 2 == 0 ? "t.csv" : "t.csv.gz");
    CsvWriter writer(file, header);
    for (std::uint64_t rows = random() % 5; rows > 0; --rows) {
      table.emplace_back();
      for (std::size_t i = 0; i < columns; ++i) {
        std::string cell = random_cell(random);
        if (columns == 1 && cell.empty()) cell = "x";  // A blank line is no row.
        writer.rows() += (i == 0 ? "" : ",") + csv_cell(cell);
        table.back().push_back(std::move(cell));
      }
      writer.rows() += '\n';
    }
    writer.close();
    ASSERT_EQ(table_of(CsvReader(file)), table) << bytes_of(file);
  }
}

TEST(Csv, LineEndsAndByteOrderMarkDoNotMatter) {
  std::mt19937_64 random(2);
  for (int round = 0; round < 300; ++round) {
    std::string plain = "a,b\n";
    for (std::uint64_t rows = random() % 5; rows > 0; --rows)
      plain += std::to_string(random() % 100) + ",\"q" + std::to_string(random() % 10) + "\"\n";
    std::string dos = "\xef\xbb\xbf";
    for (const char c : plain) dos += c == '\n' ? "\r\n" : std::string(1, c);
    EXPECT_EQ(table_of(plain), table_of(dos));
  }
}

TEST(Csv, AnyOctetsGiveRowsOrOneErrorLine) {
  std::mt19937_64 random(3);
  constexpr std::string_view kLikely = ",\"\n\r\t a1.\xef\x1f\x8b";
  for (int round = 0; round < 10'000; ++round) {
    std::string content;
    for (std::uint64_t i = random() % 40; i > 0; --i)
      content += random() % 4 == 0 ? static_cast<char>(random()) : kLikely[random() % kLikely.size()];
    const CsvLayout layout{random() % 3 == 0 ? ' ' : '\0', random() % 2 == 0, random() % 2 == 0};
    const std::string error = error_of(content, layout);
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    EXPECT_EQ(error.rfind(error.empty() ? "" : "t.csv:", 0), 0u) << error;
  }
}

TEST(Csv, GzippedTablesAreReadAndDamagedOnesRefused) {
  const Folder folder;
  const auto file = folder / "t.csv.gz";
  CsvWriter writer(file, "a");
  for (int i = 0; i < 300'000; ++i) {
    writer.rows() += std::to_string(i) + '\n';
    writer.flush_if_long();
  }
  writer.close();
  const std::string packed = bytes_of(file);
  EXPECT_TRUE(packed.starts_with("\x1f\x8b"));
  CsvReader reader(file);
  std::uint32_t rows = 0;
  while (reader.next()) ASSERT_EQ(reader.whole(0), rows++);
  EXPECT_EQ(rows, 300'000u);
  // Two gzip members, as `cat a.gz b.gz` produces.
  EXPECT_EQ(table_of(CsvReader("t.csv", packed + packed)).size(), 2u * 300'001);
  EXPECT_NE(error_of(packed.substr(0, packed.size() / 2)).find("the gzip stream is cut off"), std::string::npos);
  std::string damaged = packed;
  damaged[packed.size() / 2] = static_cast<char>(damaged[packed.size() / 2] ^ 0x55);
  EXPECT_NE(error_of(damaged).find("the gzip stream is damaged"), std::string::npos) << error_of(damaged);
}

TEST(CsvWriter, ErrorsNameTheFileAndTheReason) {
  const Folder folder;
  try {
    const CsvWriter writer(folder / "none/t.csv", "a");
    FAIL();
  } catch (const RunError& error) {
    EXPECT_EQ(error.what(), (folder / "none/t.csv").string() + ": cannot be created: No such file or directory");
  }
  CsvWriter writer("/dev/full", "a");
  EXPECT_THROW(writer.close(), RunError);
}

TEST(CsvWriter, WritesToStandardOutput) {
  testing::internal::CaptureStdout();
  CsvWriter writer("-", "a,b");
  writer.rows() += "1,2\n";
  writer.close();
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "a,b\n1,2\n");
  EXPECT_FALSE(std::filesystem::exists("-"));
}

}  // namespace
}  // namespace kilotwin

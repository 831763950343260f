// Writes the format of core/arrow/format.hpp.
#include "clients/recorder/arrow_table.hpp"

#include <flatbuffers/flatbuffers.h>

#include <bit>
#include <cstring>
#include <limits>

#include "clients/recorder/utf8.hpp"
#include "core/arrow/format.hpp"
#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

using Builder = flatbuffers::FlatBufferBuilder;
using Offset = flatbuffers::Offset<void>;

constexpr std::uint32_t kContinuation = 0xffffffff;
constexpr std::size_t kAlignment = 8;
constexpr std::int16_t kVersion5 = 4;

std::size_t padded(std::size_t size) { return (size + kAlignment - 1) / kAlignment * kAlignment; }

/// A table whose fields are written by their numbers.
class TableBuilder {
 public:
  explicit TableBuilder(Builder& builder) : builder_(builder), start_(builder.StartTable()) {}
  template <class Number> TableBuilder& number(int field, Number value) {
    builder_.AddElement<Number>(arrow::place_of(field), value);
    return *this;
  }
  template <class T> TableBuilder& offset(int field, flatbuffers::Offset<T> to) {
    builder_.AddOffset(arrow::place_of(field), to);
    return *this;
  }
  [[nodiscard]] Offset end() { return Offset(builder_.EndTable(start_)); }

 private:
  Builder& builder_;
  flatbuffers::uoffset_t start_;
};

auto pairs(Builder& builder, const TableMetadata& metadata) {
  std::vector<Offset> all;
  for (const auto& [name, value] : metadata) {
    const auto key = builder.CreateString(valid_utf8(name)), text = builder.CreateString(valid_utf8(value));
    all.push_back(TableBuilder(builder).offset(0, key).offset(1, text).end());
  }
  return builder.CreateVector(all);
}

Offset field(Builder& builder, const Column& column) {
  arrow::Type type{};
  Offset described;
  switch (column.type) {
    case CellType::kInteger:
      type = arrow::Type::kInt;
      described = TableBuilder(builder).number<std::int32_t>(0, 64).number<std::uint8_t>(1, 1).end();
      break;
    case CellType::kNumber:
    case CellType::kTime:
      type = arrow::Type::kFloatingPoint;
      described = TableBuilder(builder).number(0, arrow::kDouble).end();
      break;
    case CellType::kText:
      type = arrow::Type::kUtf8;
      described = TableBuilder(builder).end();
      break;
  }
  const auto name = builder.CreateString(valid_utf8(column.name));
  const auto children = builder.CreateVector(std::vector<Offset>{});
  const auto metadata =
      pairs(builder, column.unit.empty() ? TableMetadata{} : TableMetadata{{"unit", column.unit}});
  return TableBuilder(builder)
      .offset(0, name)
      .number<std::uint8_t>(1, 1)
      .number(2, static_cast<std::uint8_t>(type))
      .offset(3, described)
      .offset(5, children)
      .offset(6, metadata)
      .end();
}

Offset schema(Builder& builder, const std::vector<Column>& columns, const TableMetadata& metadata) {
  std::vector<Offset> fields;
  fields.reserve(columns.size());
  for (const Column& column : columns) fields.push_back(field(builder, column));
  const auto all = builder.CreateVector(fields);
  const auto about = pairs(builder, metadata);
  return TableBuilder(builder).offset(1, all).offset(2, about).end();
}

std::string finished(Builder& builder, Offset root) {
  builder.Finish(root);
  return {reinterpret_cast<const char*>(builder.GetBufferPointer()), builder.GetSize()};
}

std::string message(Builder& builder, arrow::Header kind, Offset header, std::size_t body) {
  return finished(builder, TableBuilder(builder)
                               .number(0, kVersion5)
                               .number(1, static_cast<std::uint8_t>(kind))
                               .offset(2, header)
                               .number(3, static_cast<std::int64_t>(body))
                               .end());
}

}  // namespace

ArrowTable::ArrowTable(std::filesystem::path file, std::vector<Column> columns, const TableMetadata& metadata)
    : Table(columns.size()),
      described_(std::move(columns)),
      metadata_(metadata),
      output_(std::move(file), os::OutputFile::Existing::kReplace) {
  cells_.resize(columns_);
  std::string begin(arrow::kMagic);
  begin.resize(padded(begin.size()));
  write(begin.data(), begin.size());
  Builder builder;
  const Offset header = schema(builder, described_, metadata_);
  write_message(message(builder, arrow::Header::kSchema, header, 0), {});
}

void ArrowTable::write(const void* octets, std::size_t size) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  output_.buffer().append(static_cast<const char*>(octets), size);
  output_.flush_if_above(kBlock);
  written_ += static_cast<std::int64_t>(size);
}

ArrowTable::Place ArrowTable::write_message(const std::string& header, const std::string& body) {
  Place place;
  place.offset = written_;
  std::string head(padded(header.size()), '\0');
  header.copy(head.data(), header.size());
  const auto size = static_cast<std::int32_t>(head.size());
  write(&kContinuation, sizeof kContinuation);
  write(&size, sizeof size);
  write(head.data(), head.size());
  place.head = static_cast<std::int32_t>(written_ - place.offset);
  write(body.data(), body.size());
  place.body = static_cast<std::int64_t>(body.size());
  return place;
}

void ArrowTable::mark(bool valid) {
  Cells& cells = cells_[cell_++];
  if (rows_of_batch_ % 8 == 0) cells.valid.push_back(0);
  if (valid)
    cells.valid.back() |= static_cast<std::uint8_t>(1u << rows_of_batch_ % 8);
  else
    ++cells.missing;
}

void ArrowTable::put(std::uint64_t bits) {
  cells_[cell_].values.append(reinterpret_cast<const char*>(&bits), sizeof bits);
}

void ArrowTable::integer(std::int64_t value) {
  put(std::bit_cast<std::uint64_t>(value));
  mark(true);
}

void ArrowTable::number(double value) {
  put(std::bit_cast<std::uint64_t>(value));
  mark(true);
}

void ArrowTable::text(std::string_view value) {
  Cells& cells = cells_[cell_];
  cells.begins.push_back(static_cast<std::int32_t>(cells.values.size()));
  cells.values += valid_utf8(value);
  mark(true);
}

void ArrowTable::missing() {
  Cells& cells = cells_[cell_];
  if (described_[cell_].type == CellType::kText)
    cells.begins.push_back(static_cast<std::int32_t>(cells.values.size()));
  else
    put(0);
  mark(false);
}

void ArrowTable::end_row() {
  KILOTWIN_DEMAND(cell_ == columns_);
  cell_ = 0;
  ++rows_;
  ++rows_of_batch_;
  // Texts of a batch have 32-bit places.
  constexpr std::size_t kMostText = std::size_t{1} << 30;
  bool full = rows_of_batch_ == kRowsOfBatch;
  for (const Cells& cells : cells_) full = full || cells.values.size() > kMostText;
  if (full) write_batch();
}

void ArrowTable::write_batch() {
  std::vector<arrow::FieldNode> nodes;
  std::vector<arrow::Buffer> buffers;
  std::string body;
  const auto add = [&](const void* octets, std::size_t size) {
    buffers.push_back({static_cast<std::int64_t>(body.size()), static_cast<std::int64_t>(size)});
    body.append(static_cast<const char*>(octets), size);
    body.resize(padded(body.size()));
  };
  for (std::size_t i = 0; i < columns_; ++i) {
    Cells& cells = cells_[i];
    nodes.push_back({static_cast<std::int64_t>(rows_of_batch_), cells.missing});
    add(cells.valid.data(), cells.missing > 0 ? cells.valid.size() : 0);
    if (described_[i].type == CellType::kText) {
      cells.begins.push_back(static_cast<std::int32_t>(cells.values.size()));
      add(cells.begins.data(), cells.begins.size() * sizeof(std::int32_t));
    }
    add(cells.values.data(), cells.values.size());
    cells = Cells();
  }
  Builder builder;
  const auto of_nodes = builder.CreateVectorOfStructs(nodes);
  const auto of_buffers = builder.CreateVectorOfStructs(buffers);
  const Offset batch = TableBuilder(builder)
                           .number(0, static_cast<std::int64_t>(rows_of_batch_))
                           .offset(1, of_nodes)
                           .offset(2, of_buffers)
                           .end();
  batches_.push_back(write_message(message(builder, arrow::Header::kRecordBatch, batch, body.size()), body));
  rows_of_batch_ = 0;
}

void ArrowTable::close() {
  if (rows_of_batch_ > 0) write_batch();
  const std::uint32_t end[] = {kContinuation, 0};
  write(end, sizeof end);
  Builder builder;
  std::vector<arrow::Block> blocks;
  for (const Place& place : batches_) blocks.push_back({place.offset, place.head, 0, place.body});
  const auto of_blocks = builder.CreateVectorOfStructs(blocks);
  const auto no_dictionaries = builder.CreateVectorOfStructs(std::vector<arrow::Block>{});
  const Offset about = schema(builder, described_, metadata_);
  const std::string footer = finished(builder, TableBuilder(builder)
                                                   .number(0, kVersion5)
                                                   .offset(1, about)
                                                   .offset(2, no_dictionaries)
                                                   .offset(3, of_blocks)
                                                   .end());
  write(footer.data(), footer.size());
  const auto size = static_cast<std::int32_t>(footer.size());
  write(&size, sizeof size);
  write(arrow::kMagic.data(), arrow::kMagic.size());
  output_.close();
}

}  // namespace kilotwin::recorder

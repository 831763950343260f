// Reads the format of core/arrow/format.hpp.
#include "clients/importers/arrow_file.hpp"

#include <flatbuffers/flatbuffers.h>
#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>

#include "core/arrow/format.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"

namespace kilotwin::importers {
namespace {

using arrow::Block, arrow::Buffer, arrow::FieldNode, arrow::Header, arrow::Type;

constexpr flatbuffers::voffset_t at(int field) { return arrow::place_of(field); }

using flatbuffers::Verifier;
template <class T> using Vector = flatbuffers::Vector<T>;
template <class T> using Tables = Vector<flatbuffers::Offset<T>>;

/// Common to all tables: each checks the fields that it reads. Offsets of other fields are never followed.
struct Checked : private flatbuffers::Table {
  using flatbuffers::Table::GetField;
  using flatbuffers::Table::GetPointer;
  using flatbuffers::Table::VerifyField;
  using flatbuffers::Table::VerifyOffset;
  using flatbuffers::Table::VerifyTableStart;
};

struct KeyValue : Checked {
  [[nodiscard]] const flatbuffers::String* key() const { return GetPointer<const flatbuffers::String*>(at(0)); }
  [[nodiscard]] const flatbuffers::String* value() const { return GetPointer<const flatbuffers::String*>(at(1)); }
  bool Verify(Verifier& v) const {
    return VerifyTableStart(v) && VerifyOffset(v, at(0)) && v.VerifyString(key()) && VerifyOffset(v, at(1)) &&
           v.VerifyString(value()) && v.EndTable();
  }
};

struct Int : Checked {
  [[nodiscard]] std::int32_t bits() const { return GetField<std::int32_t>(at(0), 0); }
  [[nodiscard]] bool is_signed() const { return GetField<std::uint8_t>(at(1), 0) != 0; }
  bool Verify(Verifier& v) const {
    return VerifyTableStart(v) && VerifyField<std::int32_t>(v, at(0), 4) &&
           VerifyField<std::uint8_t>(v, at(1), 1) && v.EndTable();
  }
};

struct FloatingPoint : Checked {
  [[nodiscard]] std::int16_t precision() const { return GetField<std::int16_t>(at(0), 0); }
  bool Verify(Verifier& v) const {
    return VerifyTableStart(v) && VerifyField<std::int16_t>(v, at(0), 2) && v.EndTable();
  }
};

struct Field : Checked {
  [[nodiscard]] const flatbuffers::String* name() const { return GetPointer<const flatbuffers::String*>(at(0)); }
  [[nodiscard]] Type kind() const { return static_cast<Type>(GetField<std::uint8_t>(at(2), 0)); }
  [[nodiscard]] const Int* as_int() const { return GetPointer<const Int*>(at(3)); }
  [[nodiscard]] const FloatingPoint* as_floating_point() const { return GetPointer<const FloatingPoint*>(at(3)); }
  [[nodiscard]] bool has_dictionary() const { return GetPointer<const void*>(at(4)) != nullptr; }
  [[nodiscard]] const Tables<Field>* children() const { return GetPointer<const Tables<Field>*>(at(5)); }
  bool Verify(Verifier& v) const {
    return VerifyTableStart(v) && VerifyOffset(v, at(0)) && v.VerifyString(name()) &&
           VerifyField<std::uint8_t>(v, at(2), 1) && VerifyOffset(v, at(3)) &&
           (kind() != Type::kInt || v.VerifyTable(as_int())) &&
           (kind() != Type::kFloatingPoint || v.VerifyTable(as_floating_point())) && VerifyOffset(v, at(4)) &&
           VerifyOffset(v, at(5)) && v.VerifyVector(children()) && v.VerifyVectorOfTables(children()) &&
           v.EndTable();
  }
};

struct Schema : Checked {
  [[nodiscard]] const Tables<Field>* fields() const { return GetPointer<const Tables<Field>*>(at(1)); }
  [[nodiscard]] const Tables<KeyValue>* metadata() const { return GetPointer<const Tables<KeyValue>*>(at(2)); }
  bool Verify(Verifier& v) const {
    return VerifyTableStart(v) && VerifyOffset(v, at(1)) && v.VerifyVector(fields()) &&
           v.VerifyVectorOfTables(fields()) && VerifyOffset(v, at(2)) && v.VerifyVector(metadata()) &&
           v.VerifyVectorOfTables(metadata()) && v.EndTable();
  }
};

struct Footer : Checked {
  [[nodiscard]] const Schema* schema() const { return GetPointer<const Schema*>(at(1)); }
  [[nodiscard]] const Vector<const Block*>* batches() const {
    return GetPointer<const Vector<const Block*>*>(at(3));
  }
  bool Verify(Verifier& v) const {
    return VerifyTableStart(v) && VerifyOffset(v, at(1)) && v.VerifyTable(schema()) && VerifyOffset(v, at(3)) &&
           v.VerifyVector(batches()) && v.EndTable();
  }
};

struct RecordBatch : Checked {
  [[nodiscard]] std::int64_t length() const { return GetField<std::int64_t>(at(0), 0); }
  [[nodiscard]] const Vector<const FieldNode*>* nodes() const {
    return GetPointer<const Vector<const FieldNode*>*>(at(1));
  }
  [[nodiscard]] const Vector<const Buffer*>* buffers() const {
    return GetPointer<const Vector<const Buffer*>*>(at(2));
  }
  [[nodiscard]] bool compressed() const { return GetPointer<const void*>(at(3)) != nullptr; }
  bool Verify(Verifier& v) const {
    return VerifyTableStart(v) && VerifyField<std::int64_t>(v, at(0), 8) && VerifyOffset(v, at(1)) &&
           v.VerifyVector(nodes()) && VerifyOffset(v, at(2)) && v.VerifyVector(buffers()) &&
           VerifyOffset(v, at(3)) && v.EndTable();
  }
};

struct Message : Checked {
  [[nodiscard]] Header kind() const { return static_cast<Header>(GetField<std::uint8_t>(at(1), 0)); }
  [[nodiscard]] const RecordBatch* batch() const { return GetPointer<const RecordBatch*>(at(2)); }
  bool Verify(Verifier& v) const {
    return VerifyTableStart(v) && VerifyField<std::uint8_t>(v, at(1), 1) && VerifyOffset(v, at(2)) &&
           (kind() != Header::kRecordBatch || v.VerifyTable(batch())) && v.EndTable();
  }
};

template <class Number> Number number_at(std::string_view octets, std::size_t index) {
  Number number{};
  std::memcpy(&number, octets.data() + index * sizeof number, sizeof number);
  return number;
}

class ArrowReader {
 public:
  explicit ArrowReader(const std::filesystem::path& file)
      : name_(one_line(file.string())), octets_(os::read_file(file)) {}

  ArrowFile result() {
    constexpr std::size_t kTail = sizeof(std::int32_t) + arrow::kMagic.size();
    if (octets_.size() < 8 + kTail || !octets_.starts_with(arrow::kMagic) || !octets_.ends_with(arrow::kMagic))
      throw UserError(name_ + ": is no Arrow file (Feather, version 2)");
    const auto size = number_at<std::int32_t>(part(octets_.size() - kTail, sizeof(std::int32_t)), 0);
    if (size < 0) damaged();
    const std::string_view text = part(octets_.size() - kTail - static_cast<std::size_t>(size), size);
    const Footer& footer = verified<Footer>(text);
    if (footer.schema() == nullptr || footer.schema()->fields() == nullptr) damaged();
    fields_ = footer.schema()->fields();
    if (footer.schema()->metadata() != nullptr) {
      for (const KeyValue* pair : *footer.schema()->metadata()) {
        if (pair->key() != nullptr && pair->value() != nullptr)
          out_.metadata[pair->key()->str()] = pair->value()->str();
      }
    }
    if (footer.batches() != nullptr) {
      for (const Block* block : *footer.batches()) read_batch(*block);
    }
    return std::move(out_);
  }

 private:
  [[noreturn]] void damaged() const { throw UserError(name_ + ": is damaged, or no Arrow file of version 5"); }

  [[nodiscard]] std::string_view part(std::uint64_t offset, std::int64_t size) const {
    if (size < 0 || offset > octets_.size() || static_cast<std::uint64_t>(size) > octets_.size() - offset)
      damaged();
    return std::string_view(octets_).substr(offset, static_cast<std::size_t>(size));
  }
  [[nodiscard]] std::string_view part(std::string_view body, const Buffer& buffer) const {
    if (buffer.offset < 0 || buffer.length < 0 || static_cast<std::uint64_t>(buffer.offset) > body.size() ||
        static_cast<std::uint64_t>(buffer.length) > body.size() - static_cast<std::uint64_t>(buffer.offset))
      damaged();
    return body.substr(static_cast<std::size_t>(buffer.offset), static_cast<std::size_t>(buffer.length));
  }

  /// A flatbuffer. A copy, because it must be aligned; it stays until the end.
  template <class Root> const Root& verified(std::string_view text) {
    const std::string& copy = *headers_.emplace_back(std::make_unique<std::string>(text));
    const auto* const begin = reinterpret_cast<const std::uint8_t*>(copy.data());
    Verifier verifier(begin, copy.size());
    if (!verifier.VerifyBuffer<Root>(nullptr)) damaged();
    return *flatbuffers::GetRoot<Root>(begin);
  }

  void read_batch(const Block& block) {
    constexpr std::int32_t kPrefix = 8;  // a mark, and the header's length
    if (block.offset < 0 || block.head < kPrefix) damaged();
    const auto offset = static_cast<std::uint64_t>(block.offset);
    const std::string_view header = part(offset, block.head), body = part(offset + header.size(), block.body);
    const Message& message = verified<Message>(header.substr(kPrefix));
    if (message.kind() != Header::kRecordBatch || message.batch() == nullptr) damaged();
    const RecordBatch& batch = *message.batch();
    if (batch.compressed())
      throw UserError(name_ +
                      ": is compressed; save it without compression, or as CSV. In Python: "
                      "pandas.read_feather(FILE).to_csv(\"FILE.csv\", index=False)");
    if (batch.nodes() == nullptr || batch.buffers() == nullptr || batch.length() < 0) damaged();
    if (batch.nodes()->size() != fields_->size()) throw UserError(name_ + ": has columns of lists or structs");
    std::size_t buffer = 0;
    const auto next = [&] {
      if (buffer >= batch.buffers()->size()) damaged();
      return part(body, *batch.buffers()->Get(static_cast<flatbuffers::uoffset_t>(buffer++)));
    };
    const auto rows = static_cast<std::size_t>(batch.length());
    for (const Field* field : *fields_) {
      const bool is_encoded = field->has_dictionary();
      if (field->kind() == Type::kNull && !is_encoded) continue;  // the only kind without buffers
      const std::string_view valid = next();
      if (!valid.empty() && valid.size() * 8 < rows) damaged();
      const auto is_there = [&](std::size_t row) {
        return valid.empty() || (static_cast<unsigned char>(valid[row / 8]) >> row % 8 & 1) != 0;
      };
      const bool is_text = field->kind() == Type::kUtf8 && !is_encoded;
      const bool is_other_text =
          !is_encoded && (field->kind() == Type::kBinary || field->kind() == Type::kLargeBinary ||
                          field->kind() == Type::kLargeUtf8);
      const std::string_view first = next();
      const std::string_view second = is_text || is_other_text ? next() : std::string_view();
      if (field->name() == nullptr) continue;
      if (is_text)
        add_texts(out_.columns[field->name()->str()], first, second, rows, is_there);
      else if (!is_other_text)
        add_numbers(*field, first, rows, is_there);
    }
    out_.rows += rows;
  }

  template <class IsThere>
  void add_texts(ArrowColumn& column, std::string_view begins, std::string_view texts, std::size_t rows,
                 IsThere is_there) {
    column.is_text = true;
    if (rows > 0 && begins.size() / sizeof(std::int32_t) < rows + 1) damaged();
    for (std::size_t row = 0; row < rows; ++row) {
      const auto begin = number_at<std::int32_t>(begins, row), end = number_at<std::int32_t>(begins, row + 1);
      if (begin < 0 || end < begin || static_cast<std::size_t>(end) > texts.size()) damaged();
      column.texts.emplace_back(
          is_there(row) ? texts.substr(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin))
                        : std::string_view());
    }
  }

  template <class IsThere>
  void add_numbers(const Field& field, std::string_view octets, std::size_t rows, IsThere is_there) {
    const auto add = [&]<class Number>(Number) {
      ArrowColumn& column = out_.columns[field.name()->str()];
      if (octets.size() / sizeof(Number) < rows) damaged();
      for (std::size_t row = 0; row < rows; ++row)
        column.numbers.push_back(is_there(row) ? static_cast<double>(number_at<Number>(octets, row))
                                               : std::numeric_limits<double>::quiet_NaN());
    };
    if (field.has_dictionary()) return;
    if (field.kind() == Type::kFloatingPoint && field.as_floating_point() != nullptr) {
      if (field.as_floating_point()->precision() == arrow::kDouble) add(double{});
      if (field.as_floating_point()->precision() == arrow::kSingle) add(float{});
    }
    if (field.kind() != Type::kInt || field.as_int() == nullptr) return;
    const bool is_signed = field.as_int()->is_signed();
    switch (field.as_int()->bits()) {
      case 8: return is_signed ? add(std::int8_t{}) : add(std::uint8_t{});
      case 16: return is_signed ? add(std::int16_t{}) : add(std::uint16_t{});
      case 32: return is_signed ? add(std::int32_t{}) : add(std::uint32_t{});
      case 64: return is_signed ? add(std::int64_t{}) : add(std::uint64_t{});
      default: return damaged();
    }
  }

  const std::string name_, octets_;
  std::vector<std::unique_ptr<std::string>> headers_;
  const Tables<Field>* fields_ = nullptr;
  ArrowFile out_;
};

}  // namespace

ArrowFile read_arrow(const std::filesystem::path& file) { return ArrowReader(file).result(); }

}  // namespace kilotwin::importers

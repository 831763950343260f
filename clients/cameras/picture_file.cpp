#include "clients/cameras/picture_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <charconv>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "core/base/error.hpp"

namespace kilotwin::cameras {
namespace {

std::string big_endian(std::uint32_t value, int bytes) {
  std::string text;
  for (int byte = bytes - 1; byte >= 0; --byte) text += static_cast<char>(value >> (8 * byte) & 0xffu);
  return text;
}

/// As a segment COM behind the JFIF header, which must be the first segment.
std::string jpeg_with_comment(std::string_view file, const std::string& comment) {
  constexpr std::size_t kMarker = 2, kLengthAt = 4;
  std::size_t at = kMarker;
  if (file.substr(at, kMarker) == "\xff\xe0") {
    const auto high = static_cast<std::uint8_t>(file[kLengthAt]),
               low = static_cast<std::uint8_t>(file[kLengthAt + 1]);
    at += kMarker + (std::size_t{high} << 8 | low);
  }
  std::string result(file.substr(0, at));
  result += "\xff\xfe" + big_endian(static_cast<std::uint32_t>(comment.size() + kMarker), 2) + comment;
  return result.append(file.substr(at));
}

/// After the header chunk, as a chunk tEXt.
std::string png_with_comment(std::string_view file, const std::string& comment) {
  constexpr std::size_t kSignatureAndHeader = 8 + 25;
  const std::string chunk = "tEXtComment" + std::string(1, '\0') + comment;
  const auto crc = static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), static_cast<uInt>(chunk.size())));
  std::string result(file.substr(0, kSignatureAndHeader));
  result += big_endian(static_cast<std::uint32_t>(chunk.size() - 4), 4) + chunk + big_endian(crc, 4);
  return result.append(file.substr(kSignatureAndHeader));
}

/// Takes a name and the number behind it off the front of a text; false where they are not there.
template <class Number, class... Base>
bool take(std::string_view& text, std::string_view name, Number& number, Base... base) {
  if (!text.starts_with(name)) return false;
  text.remove_prefix(name.size());
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base...);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

}  // namespace

std::string FrameStamp::text() const {
  return fmt::format("kilotwin frame={} run={:016x} tick={} simulated_s={:.6f} capture_ns={}", frame, run, tick,
                     simulated_s, capture_ns);
}

std::optional<PictureFormat> format_of(std::string_view name) {
  if (name.ends_with(".jpg") || name.ends_with(".jpeg")) return PictureFormat::kJpeg;
  if (name.ends_with(".png")) return PictureFormat::kPng;
  return std::nullopt;
}

std::string encoded(const cv::Mat& picture, PictureFormat format, const FrameStamp& stamp, int quality) {
  std::vector<std::uint8_t> bytes;
  const bool jpeg = format == PictureFormat::kJpeg;
  const std::vector<int> parameters =
      jpeg ? std::vector<int>{cv::IMWRITE_JPEG_QUALITY, quality} : std::vector<int>{cv::IMWRITE_PNG_COMPRESSION, 1};
  if (!cv::imencode(jpeg ? ".jpg" : ".png", picture, bytes, parameters))
    throw RunError("a picture could not be encoded");
  const std::string_view file(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  // The line's end separates the last number from the bytes behind it, which may be digits.
  const std::string comment = stamp.text() + "\n";
  return jpeg ? jpeg_with_comment(file, comment) : png_with_comment(file, comment);
}

std::optional<FrameStamp> stamp_of(std::string_view file) {
  // The stamp lies in front of the picture's own data.
  constexpr std::size_t kWithin = 512;
  std::string_view text = file.substr(0, kWithin);
  const std::size_t at = text.find("kilotwin frame=");
  if (at == std::string_view::npos) return std::nullopt;
  text.remove_prefix(at);
  FrameStamp stamp;
  constexpr int kDecimal = 10, kHexadecimal = 16;
  if (!take(text, "kilotwin frame=", stamp.frame, kDecimal) || !take(text, " run=", stamp.run, kHexadecimal) ||
      !take(text, " tick=", stamp.tick, kDecimal) || !take(text, " simulated_s=", stamp.simulated_s) ||
      !take(text, " capture_ns=", stamp.capture_ns, kDecimal))
    return std::nullopt;
  return stamp;
}

}  // namespace kilotwin::cameras

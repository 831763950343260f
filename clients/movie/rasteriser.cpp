#include "clients/movie/rasteriser.hpp"

#include <fmt/format.h>
#include <librsvg/rsvg.h>

#include <cstddef>
#include <memory>

#include "core/base/error.hpp"

namespace kilotwin::movie {
namespace {

struct Release {
  void operator()(RsvgHandle* handle) const { g_object_unref(handle); }
  void operator()(GError* error) const { g_error_free(error); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
template <class Thing> using Owned = std::unique_ptr<Thing, Release>;

[[noreturn]] void fail(GError* raw) {
  const Owned<GError> error(raw);
  throw RunError(fmt::format("a frame cannot be drawn: {}", error ? error->message : "unknown reason"));
}

}  // namespace

std::vector<std::uint8_t> rasterised(const std::string& svg, int width_px, int height_px) {
  GError* error = nullptr;
  const Owned<RsvgHandle> handle(
      rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), &error));
  if (!handle) fail(error);
  const int stride = cairo_format_stride_for_width(CAIRO_FORMAT_RGB24, width_px);
  std::vector<std::uint8_t> picture(static_cast<std::size_t>(stride) * static_cast<std::size_t>(height_px));
  const Owned<cairo_surface_t> surface(
      cairo_image_surface_create_for_data(picture.data(), CAIRO_FORMAT_RGB24, width_px, height_px, stride));
  const Owned<cairo_t> context(cairo_create(surface.get()));
  const RsvgRectangle all{0, 0, static_cast<double>(width_px), static_cast<double>(height_px)};
  if (rsvg_handle_render_document(handle.get(), context.get(), &all, &error) == FALSE) fail(error);
  cairo_surface_flush(surface.get());
  return picture;
}

}  // namespace kilotwin::movie

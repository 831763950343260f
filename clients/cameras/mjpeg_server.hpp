/// MjpegServer: pictures over HTTP on 127.0.0.1, for browsers and for trackers that open a network camera.
///
///   /camera.mjpg   a stream of JPEG pictures (multipart/x-mixed-replace), each with the headers X-Frame and X-Capture-Unix-Ns
///   /picture.jpg   the newest picture
///   /              a page with the stream
///
/// A client that reads slowly gets fewer pictures. It never delays post(), or another client.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "clients/cameras/picture_file.hpp"

namespace kilotwin::cameras {

class MjpegServer {
 public:
  /// Serves from a thread of its own. Port 0: one that is free. Throws UserError where the port is taken.
  explicit MjpegServer(std::uint16_t port);
  ~MjpegServer();
  MjpegServer(const MjpegServer&) = delete;

  [[nodiscard]] std::uint16_t port() const;
  /// The newest picture, a JPEG. Returns at once.
  void post(const std::string& jpeg, const FrameStamp& stamp);
  /// Clients that read the stream at the moment.
  [[nodiscard]] std::uint32_t clients() const;

 private:
  class Service;
  std::unique_ptr<Service> service_;
};

}  // namespace kilotwin::cameras

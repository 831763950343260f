#include "clients/cameras/mjpeg_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <string_view>

#include "clients/http/server.hpp"

namespace kilotwin::cameras {
namespace {

constexpr const char* kBoundary = "kilotwin-frame";
constexpr const char* kWebPage =
    "<!doctype html><title>Kilotwin camera</title><style>body{margin:0;background:#222}img{width:100%}</style>"
    "<img src=\"/camera.mjpg\" alt=\"the arena from above\">";
/// Bytes that are handed to the library at once.
constexpr std::size_t kChunk = 65536;

struct Posted {
  std::string part;  // boundary, headers, picture
  std::size_t picture_at = 0;
  std::uint64_t number = 0;
};
using PostedPicture = std::shared_ptr<const Posted>;

/// The data that libwebsockets keeps for each connection. It is zeroed memory: `sending` lives from begin() to end().
struct Client {
  enum class Kind : std::uint8_t { kNone, kStream, kPicture, kPage } kind;
  PostedPicture* sending;
  std::size_t sent;
  std::uint64_t shown;  // number of the picture that was sent last
};

}  // namespace

class MjpegServer::Service {
 public:
  explicit Service(std::uint16_t port)
      : server_(port, wanted(this),
                fmt::format("--mjpeg: port {} of 127.0.0.1 cannot be served; choose one that is free", port)) {}
  Service(const Service&) = delete;

  void post(const std::string& jpeg, const FrameStamp& stamp) {
    auto posted = std::make_shared<Posted>();
    posted->part = fmt::format(
        "--{}\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\nX-Frame: {}\r\nX-Capture-Unix-Ns: {}\r\n\r\n",
        kBoundary, jpeg.size(), stamp.frame, stamp.capture_ns);
    posted->picture_at = posted->part.size();
    posted->part += jpeg + "\r\n";
    {
      const std::lock_guard lock(mutex_);
      posted->number = newest_ ? newest_->number + 1 : 1;
      newest_ = std::move(posted);
    }
    server_.wake();
  }

  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  [[nodiscard]] std::uint32_t clients() const { return streams_; }

 private:
  static lws_context_creation_info wanted(Service* user) {
    static const std::array<lws_protocols, 2> protocols{
        {{"http", &Service::on_event, sizeof(Client), 0, 0, nullptr, 0}, {nullptr, nullptr, 0, 0, 0, nullptr, 0}}};
    lws_context_creation_info info{};
    info.protocols = protocols.data();
    info.user = user;
    return info;
  }
  static int on_event(lws* connection, lws_callback_reasons reason, void* user, void* in, std::size_t length) {
    auto* const service = static_cast<Service*>(lws_context_user(lws_get_context(connection)));
    auto* const client = static_cast<Client*>(user);
    switch (reason) {
      case LWS_CALLBACK_HTTP: return service->begin(connection, *client, {static_cast<char*>(in), length});
      case LWS_CALLBACK_HTTP_WRITEABLE: return service->go_on(connection, *client);
      case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
        lws_callback_on_writable_all_protocol(lws_get_context(connection), lws_get_protocol(connection));
        return 0;
      case LWS_CALLBACK_CLOSED_HTTP:
        if (client != nullptr) service->end(*client);
        return 0;
      default: return lws_callback_http_dummy(connection, reason, user, in, length);
    }
  }

  [[nodiscard]] PostedPicture newest() {
    const std::lock_guard lock(mutex_);
    return newest_;
  }

  int begin(lws* connection, Client& client, std::string_view path) {
    const bool stream = path == "/camera.mjpg", picture = path == "/picture.jpg";
    if (!stream && !picture && path != "/")
      return lws_return_http_status(connection, HTTP_STATUS_NOT_FOUND, nullptr) < 0
                 ? -1
                 : lws_http_transaction_completed(connection);
    const PostedPicture now = newest();
    if (picture && !now)
      return lws_return_http_status(connection, HTTP_STATUS_SERVICE_UNAVAILABLE, "no picture has been taken yet") <
                     0
                 ? -1
                 : lws_http_transaction_completed(connection);
    const std::string type = stream    ? fmt::format("multipart/x-mixed-replace; boundary={}", kBoundary)
                             : picture ? "image/jpeg"
                                       : "text/html";
    const lws_filepos_t size = stream    ? LWS_ILLEGAL_HTTP_CONTENT_LEN
                               : picture ? now->part.size() - now->picture_at - 2
                                         : std::string_view(kWebPage).size();
    std::array<unsigned char, LWS_PRE + 1024> headers{};
    unsigned char* at = headers.data() + LWS_PRE;
    unsigned char* const start = at;
    unsigned char* const most = headers.data() + headers.size() - 1;
    constexpr std::string_view kFresh = "no-store";
    if (lws_add_http_common_headers(connection, HTTP_STATUS_OK, type.c_str(), size, &at, most) != 0 ||
        lws_add_http_header_by_name(connection, reinterpret_cast<const unsigned char*>("cache-control:"),
                                    reinterpret_cast<const unsigned char*>(kFresh.data()),
                                    static_cast<int>(kFresh.size()), &at, most) != 0 ||
        lws_finalize_write_http_header(connection, start, &at, most) != 0)
      return 1;
    client.kind = stream ? Client::Kind::kStream : picture ? Client::Kind::kPicture : Client::Kind::kPage;
    if (picture) {
      client.sending = new PostedPicture(now);
      client.sent = now->picture_at;
    }
    if (stream) {
      ++streams_;
      // The library ends answers after some seconds; a stream lasts as long as its client wants it.
      lws_set_timeout(connection, NO_PENDING_TIMEOUT, 0);
    }
    lws_callback_on_writable(connection);
    return 0;
  }

  int go_on(lws* connection, Client& client) {
    if (client.kind == Client::Kind::kNone) return 0;
    if (client.kind == Client::Kind::kPage) {
      if (!write(connection, kWebPage, true)) return -1;
      return lws_http_transaction_completed(connection) != 0 ? -1 : 0;
    }
    if (client.sending == nullptr) {
      const PostedPicture now = newest();
      if (!now || now->number == client.shown) return 0;  // the next post() wakes it up
      client.sending = new PostedPicture(now);
      client.sent = 0;
    }
    const Posted& picture = **client.sending;
    const bool stream = client.kind == Client::Kind::kStream;
    const std::size_t all = picture.part.size() - (stream ? 0 : 2);
    const std::size_t count = std::min(kChunk, all - client.sent);
    const bool last = client.sent + count == all;
    if (!write(connection, std::string_view(picture.part).substr(client.sent, count), last && !stream)) return -1;
    client.sent += count;
    if (!last) {
      lws_callback_on_writable(connection);
      return 0;
    }
    client.shown = picture.number;
    delete client.sending;
    client.sending = nullptr;
    if (!stream) return lws_http_transaction_completed(connection) != 0 ? -1 : 0;
    lws_set_timeout(connection, NO_PENDING_TIMEOUT, 0);
    lws_callback_on_writable(connection);
    return 0;
  }

  [[nodiscard]] bool write(lws* connection, std::string_view text, bool last) {
    return server_.write(connection, text, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP);
  }

  void end(Client& client) {
    if (client.kind == Client::Kind::kStream) --streams_;
    client.kind = Client::Kind::kNone;
    delete client.sending;
    client.sending = nullptr;
  }

  std::atomic<std::uint32_t> streams_{0};
  std::mutex mutex_;
  PostedPicture newest_;  // guarded by mutex_
  http::Server server_;
};

MjpegServer::MjpegServer(std::uint16_t port) : service_(std::make_unique<Service>(port)) {}
MjpegServer::~MjpegServer() = default;
std::uint16_t MjpegServer::port() const { return service_->port(); }
void MjpegServer::post(const std::string& jpeg, const FrameStamp& stamp) { service_->post(jpeg, stamp); }
std::uint32_t MjpegServer::clients() const { return service_->clients(); }

}  // namespace kilotwin::cameras

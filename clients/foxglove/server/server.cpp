// The protocol: github.com/foxglove/ws-protocol, docs/spec.md.
#include "clients/foxglove/server/server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/http/request_allowance.hpp"
#include "clients/http/server.hpp"
#include "core/base/base64.hpp"
#include "core/base/error.hpp"

namespace kilotwin::foxglove {
namespace {

using nlohmann::json;

/// Kinds of binary messages.
constexpr char kMessageData = 1, kTime = 2;
constexpr std::uint16_t kPingAfter_s = 20, kHangUpAfter_s = 40;
constexpr unsigned kHeaderTimeout_s = 5;
constexpr int kMostConnections = 200;

template <class Number> void put(std::string& to, Number value) {
  for (std::size_t i = 0; i < sizeof value; ++i) to += static_cast<char>(value >> 8 * i & 0xff);
}

struct Message {
  std::uint64_t number = 0;  ///< of all messages, ascending
  Time_ns time = 0;
  std::shared_ptr<const std::string> octets;
};

struct Channel {
  json advertised;
  std::size_t matter = 1;
  std::deque<Message> newest;
};

struct Subscription {
  std::uint16_t channel = 0;
  std::uint64_t sent = 0;  ///< number of the last message
};

struct Viewer {
  std::uint64_t session = 0, time_sent = 0;
  std::uint16_t advertised = 0;                         ///< channels below it
  std::map<std::uint32_t, Subscription> subscriptions;  ///< by the viewer's numbers
  std::uint32_t last_served = 0;                        ///< subscriptions take turns
  std::string incoming;
  http::RequestAllowance allowance;
};

/// The data that libwebsockets keeps per connection, as zeroed memory.
struct Session {
  Viewer* viewer;
};

/// Where the viewers' pages come from: Foxglove, Lichtblick, and programs of the desktop, whose pages are files.
constexpr std::array<std::string_view, 4> kViewers{"https://app.foxglove.dev", "https://studio.foxglove.dev",
                                                   "https://lichtblick-suite.github.io", "file://"};

/// Whether a page comes from a server of this machine.
bool is_local(std::string_view origin) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (!origin.starts_with(scheme)) continue;
    const std::string_view host = origin.substr(scheme.size());
    const std::string_view name = host.substr(0, host.find(':'));
    return name == "localhost" || name == "127.0.0.1";
  }
  return false;
}

}  // namespace

class Server::Service {
 public:
  Service(const http::Endpoint& endpoint, std::vector<std::string> origins)
      : origins_(std::move(origins)),
        server_(endpoint, wanted(this),
                fmt::format("--port {}: cannot be served on {}; choose a port that is free, or 0", endpoint.port,
                            endpoint.host)) {}

  void begin(std::string session) {
    {
      const std::lock_guard lock(mutex_);
      name_ = std::move(session);
      ++session_;
      first_ = static_cast<std::uint16_t>(first_ + channels_.size());
      channels_.clear();
    }
    server_.wake();
  }
  std::uint16_t add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema,
                            std::size_t matter) {
    const std::lock_guard lock(mutex_);
    const auto id = static_cast<std::uint16_t>(first_ + channels_.size());
    channels_.push_back({{{"id", id},
                          {"topic", topic},
                          {"encoding", "protobuf"},
                          {"schemaName", schema_name},
                          {"schema", base64(schema)},
                          {"schemaEncoding", "protobuf"}},
                         matter,
                         {}});
    return id;
  }
  void write(std::uint16_t channel, Time_ns time, std::string_view message) {
    {
      const std::lock_guard lock(mutex_);
      Channel& to = channels_.at(static_cast<std::size_t>(channel - first_));
      to.newest.push_back({++number_, time, std::make_shared<const std::string>(message)});
      if (to.newest.size() > to.matter) to.newest.pop_front();
      time_ = time;
    }
    server_.wake();
  }

  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  [[nodiscard]] std::uint32_t viewers() const { return viewers_; }

 private:
  static lws_context_creation_info wanted(Service* user) {
    static const std::array<lws_protocols, 4> protocols{
        {{"http", lws_callback_http_dummy, 0, 0, 0, nullptr, 0},
         {"foxglove.websocket.v1", &Service::on_socket, sizeof(Session), kLongestRequest_bytes, 0, nullptr, 0},
         {"foxglove.sdk.v1", &Service::on_socket, sizeof(Session), kLongestRequest_bytes, 0, nullptr, 0},
         {nullptr, nullptr, 0, 0, 0, nullptr, 0}}};
    static const lws_retry_bo_t patience{nullptr, 0, 0, kPingAfter_s, kHangUpAfter_s, 0};
    lws_context_creation_info info{};
    info.protocols = protocols.data();
    info.user = user;
    info.timeout_secs = kHeaderTimeout_s;
    info.fd_limit_per_thread = kMostConnections;
    info.retry_and_idle_policy = &patience;
    return info;
  }

  static int on_socket(lws* connection, lws_callback_reasons reason, void* user, void* in, std::size_t length) {
    Service& service = *static_cast<Service*>(lws_context_user(lws_get_context(connection)));
    auto* const session = static_cast<Session*>(user);
    switch (reason) {
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        return service.admits(connection) && service.viewers_ < kMostViewers ? 0 : -1;
      case LWS_CALLBACK_ESTABLISHED:
        session->viewer = new Viewer;
        ++service.viewers_;
        lws_callback_on_writable(connection);
        return 0;
      case LWS_CALLBACK_RECEIVE:
        return service.receive(connection, *session->viewer, {static_cast<char*>(in), length});
      case LWS_CALLBACK_SERVER_WRITEABLE: return service.send_next(connection, *session->viewer);
      case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
        lws_callback_on_writable_all_protocol(lws_get_context(connection), lws_get_protocol(connection));
        return 0;
      case LWS_CALLBACK_CLOSED:
        if (session != nullptr && session->viewer != nullptr) {
          delete std::exchange(session->viewer, nullptr);
          --service.viewers_;
        }
        return 0;
      default: return 0;
    }
  }

  [[nodiscard]] bool admits(lws* connection) const {
    if (!server_.is_named_by(connection)) return false;
    const std::string origin = http::header_of(connection, WSI_TOKEN_ORIGIN);
    const auto is_it = [&origin](std::string_view other) { return origin == other; };
    return http::has_no_origin(connection) || is_local(origin) ||
           std::any_of(kViewers.begin(), kViewers.end(), is_it) ||
           std::any_of(origins_.begin(), origins_.end(), is_it);
  }

  int receive(lws* connection, Viewer& viewer, std::string_view part) {
    if (viewer.incoming.size() + part.size() > kLongestRequest_bytes)
      return http::closed(connection, LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE, "the request is too long");
    if (!http::is_whole(connection, viewer.incoming, part)) return 0;
    const std::string text = std::exchange(viewer.incoming, {});
    if (!viewer.allowance.take(http::RequestAllowance::Clock::now()))
      return http::closed(connection, LWS_CLOSE_STATUS_POLICY_VIOLATION, "too many requests");
    if (lws_frame_is_binary(connection) != 0) return 0;  // what viewers publish is of no interest
    const json request = json::parse(text, nullptr, false);
    if (!request.is_object())
      return http::closed(connection, LWS_CLOSE_STATUS_INVALID_PAYLOAD, "that is no JSON object");
    if (!take(viewer, request))
      return http::closed(connection, LWS_CLOSE_STATUS_POLICY_VIOLATION,
                          "that is no subscription, or one too many");
    lws_callback_on_writable(connection);
    return 0;
  }

  static std::optional<std::uint32_t> number(const json& object, const char* key) {
    const auto found = object.find(key);
    if (found == object.end() || !found->is_number_unsigned() || found->get<std::uint64_t>() > 0xffffffffu)
      return std::nullopt;
    return found->get<std::uint32_t>();
  }

  /// False for a request that breaks the rules. Requests of what is not offered are ignored.
  static bool take(Viewer& viewer, const json& request) {
    const auto op = request.find("op");
    if (op == request.end() || !op->is_string()) return false;
    if (*op == "subscribe") {
      const auto list = request.find("subscriptions");
      if (list == request.end() || !list->is_array()) return false;
      for (const json& item : *list) {
        if (!item.is_object()) return false;
        const auto id = number(item, "id"), channel = number(item, "channelId");
        if (!id || !channel || viewer.subscriptions.size() >= kMostSubscriptions) return false;
        if (*channel <= 0xffff) viewer.subscriptions[*id] = {static_cast<std::uint16_t>(*channel), 0};
      }
    } else if (*op == "unsubscribe") {
      const auto list = request.find("subscriptionIds");
      if (list == request.end() || !list->is_array()) return false;
      for (const json& id : *list) {
        if (!id.is_number_unsigned()) return false;
        viewer.subscriptions.erase(id.get<std::uint32_t>());
      }
    }
    return true;
  }

  /// Sends one message.
  int send_next(lws* connection, Viewer& viewer) {
    const auto [message, binary] = next_message(viewer);
    if (message.empty()) return 0;
    if (!server_.write(connection, message, binary ? LWS_WRITE_BINARY : LWS_WRITE_TEXT)) return -1;
    lws_callback_on_writable(connection);
    return 0;
  }

  struct Outgoing {
    std::string message;
    bool binary = false;
  };

  Outgoing next_message(Viewer& viewer) {
    const std::lock_guard lock(mutex_);
    if (session_ == 0) return {};  // no run yet
    if (viewer.session != session_) {
      viewer = Viewer();
      viewer.session = session_;
      viewer.advertised = first_;
      return {json{
          {"op", "serverInfo"},
          {"name", "kilotwin"},
          {"capabilities", {"time"}},
          {"supportedEncodings", json::array()},
          {"metadata", json::object()},
          {"sessionId",
           name_}}.dump(-1, ' ', false, json::error_handler_t::replace)};
    }
    if (const auto end = static_cast<std::uint16_t>(first_ + channels_.size()); viewer.advertised != end) {
      json channels = json::array();
      for (; viewer.advertised != end; ++viewer.advertised)
        channels.push_back(channels_[static_cast<std::size_t>(viewer.advertised - first_)].advertised);
      return {json{{"op", "advertise"}, {"channels", channels}}.dump()};
    }
    if (viewer.subscriptions.empty()) return {};
    if (viewer.time_sent != time_) {
      viewer.time_sent = time_;
      std::string message(1, kTime);
      put(message, time_);
      return {std::move(message), true};
    }
    return next_data(viewer);
  }

  /// The next message of a subscription, those after the one served last first.
  Outgoing next_data(Viewer& viewer) {
    auto at = viewer.subscriptions.upper_bound(viewer.last_served);
    for (std::size_t i = 0; i < viewer.subscriptions.size(); ++i, ++at) {
      if (at == viewer.subscriptions.end()) at = viewer.subscriptions.begin();
      auto& [id, subscription] = *at;
      if (subscription.channel < first_ || subscription.channel >= first_ + channels_.size()) continue;
      for (const Message& message : channels_[static_cast<std::size_t>(subscription.channel - first_)].newest) {
        if (message.number <= subscription.sent) continue;
        subscription.sent = message.number;
        viewer.last_served = id;
        std::string octets(1, kMessageData);
        put(octets, id);
        put(octets, message.time);
        return {octets + *message.octets, true};
      }
    }
    return {};
  }

  const std::vector<std::string> origins_;
  std::mutex mutex_;
  // Guarded by mutex_.
  std::string name_;
  std::uint64_t session_ = 0, number_ = 0;
  Time_ns time_ = 0;
  std::uint16_t first_ = 1;  ///< number of the first channel: no number serves twice
  std::vector<Channel> channels_;

  std::atomic<std::uint32_t> viewers_{0};
  http::Server server_;
};

Server::Server(const http::Endpoint& endpoint, std::vector<std::string> origins)
    : service_(std::make_unique<Service>(endpoint, std::move(origins))) {}
Server::~Server() = default;
void Server::begin(std::string session) { service_->begin(std::move(session)); }
std::uint16_t Server::add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema,
                                  std::size_t matter) {
  return service_->add_channel(topic, schema_name, schema, matter);
}
void Server::write(std::uint16_t channel, Time_ns time, std::string_view message) {
  service_->write(channel, time, message);
}
std::uint16_t Server::port() const { return service_->port(); }
std::uint32_t Server::viewers() const { return service_->viewers(); }

}  // namespace kilotwin::foxglove

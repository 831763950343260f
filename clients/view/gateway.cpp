#include "clients/view/gateway.hpp"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "clients/http/request_allowance.hpp"
#include "clients/http/server.hpp"
#include "clients/view/run_text.hpp"
#include "core/base/error.hpp"

namespace kilotwin::view {
namespace {

using Clock = std::chrono::steady_clock;
double steady_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

/// Bytes of a file that are handed to the library at once.
constexpr std::size_t kChunk_bytes = 65536;
/// Lines that wait for one viewer, and its questions; further lines are dropped, and older questions.
constexpr std::size_t kMostWaitingLines = 8, kMostQuestions = 16;
/// A viewer that answers no ping for so long is disconnected.
constexpr std::uint16_t kPingAfter_s = 20, kHangUpAfter_s = 40;
/// Bounds of clients that open connections and say nothing.
constexpr int kMostConnections = 400, kMostHeaders = 300;
constexpr unsigned kHeaderTimeout_s = 5;

constexpr std::array<std::pair<const char*, const char*>, 6> kHeaders{
    {{"cache-control:", "no-cache"},
     {"content-security-policy:",
      "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
      "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
     {"x-content-type-options:", "nosniff"},
     {"referrer-policy:", "no-referrer"},
     {"cross-origin-opener-policy:", "same-origin"},
     {"cross-origin-resource-policy:", "same-origin"}}};

using Message = std::shared_ptr<const std::string>;

/// The newest message of a kind. Viewers remember the number that they have seen.
struct Newest {
  Message message;
  std::uint64_t number = 0;
  void set(std::string text) {
    message = std::make_shared<const std::string>(std::move(text));
    ++number;
  }
};

struct Viewer {
  explicit Viewer(lws* at_connection) : connection(at_connection) {}
  lws* const connection;
  double served_s = 0;  // the time of its answers, from the place in the queue where it began to wait
  bool may_steer = false, wants_frame = false;
  std::uint64_t run_seen = 0, status_seen = 0, frame_seen = 0, floors_seen = 0;
  std::optional<Request> at;
  std::deque<Request> questions;  // at most kMostQuestions
  std::deque<std::string> lines;
  Message answered_frame;  // nullptr: none
  std::string incoming;
  http::RequestAllowance allowance;

  /// A question replaces an earlier one of its kind; curves wait beside each other.
  void ask(const Request& request) {
    if (request.kind != Request::Kind::kPlot)
      std::erase_if(questions, [&request](const Request& other) { return other.kind == request.kind; });
    if (questions.size() == kMostQuestions) questions.pop_front();
    questions.push_back(request);
  }
  std::optional<Request> next_question() {
    if (questions.empty()) return std::nullopt;
    const Request question = questions.front();
    questions.pop_front();
    return question;
  }
  [[nodiscard]] bool waits() const { return at || !questions.empty(); }
  void tell(std::string line) {
    if (lines.size() < kMostWaitingLines) lines.push_back(std::move(line));
  }
};

/// State per connection. libwebsockets keeps it, as zeroed memory.
struct Download {
  const PageFile* file;
  std::size_t sent;
};
struct Session {
  Viewer* viewer;
};

/// Takes the same time for every wrong token.
bool equal_tokens(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

}  // namespace

class Gateway::Service {
 public:
  Service(const http::Endpoint& endpoint, std::string token, PageFiles page, Clock_s clock)
      : clock_(clock ? std::move(clock) : steady_s),
        token_(std::move(token)),
        page_(std::move(page)),
        server_(
            endpoint, wanted(this),
            fmt::format("--port {}: cannot be served on {}; choose a port that is free, or leave the option out",
                        endpoint.port, endpoint.host)) {}
  Service(const Service&) = delete;

  void show(Answers& answers, std::string run_text) {
    {
      const std::scoped_lock lock(answering_, mutex_);
      answers_ = &answers;
      has_answers_ = true;
      run_.set(std::move(run_text));
      status_.message.reset();
      frame_.message.reset();
    }
    server_.wake();
  }
  void post(Newest Service::*which, std::string message) {
    {
      const std::lock_guard lock(mutex_);
      (this->*which).set(std::move(message));
    }
    server_.wake();
  }

  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  [[nodiscard]] std::string address() const { return fmt::format("{}/#token={}", server_.origin(), token_); }
  [[nodiscard]] Traffic traffic() const { return {viewers_, frames_, bytes_, refused_}; }

  Newest run_, status_, frame_;  // guarded by mutex_

 private:
  static lws_context_creation_info wanted(Service* user) {
    static const std::array<lws_protocols, 3> protocols{
        {{"http", &Service::on_http, sizeof(Download), 0, 0, nullptr, 0},
         {kSubprotocol, &Service::on_socket, sizeof(Session), kLongestRequest_bytes, 0, nullptr, 0},
         {nullptr, nullptr, 0, 0, 0, nullptr, 0}}};
    static const lws_retry_bo_t patience{nullptr, 0, 0, kPingAfter_s, kHangUpAfter_s, 0};
    lws_context_creation_info info{};
    info.protocols = protocols.data();
    info.user = user;
    info.timeout_secs = kHeaderTimeout_s;
    info.max_http_header_pool = kMostHeaders;
    info.fd_limit_per_thread = kMostConnections;
    info.retry_and_idle_policy = &patience;
    return info;
  }
  static Service& of(lws* connection) {
    return *static_cast<Service*>(lws_context_user(lws_get_context(connection)));
  }

  // The page.

  static int on_http(lws* connection, lws_callback_reasons reason, void* user, void* in, std::size_t length) {
    auto* const download = static_cast<Download*>(user);
    switch (reason) {
      case LWS_CALLBACK_HTTP:
        return of(connection).begin_file(connection, *download, {static_cast<char*>(in), length});
      case LWS_CALLBACK_HTTP_WRITEABLE: return of(connection).go_on_with_file(connection, *download);
      // A WebSocket that names no subprotocol, or another one.
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: ++of(connection).refused_; return -1;
      default: return lws_callback_http_dummy(connection, reason, user, in, length);
    }
  }

  int refuse(lws* connection, unsigned status, const char* why) {
    ++refused_;
    if (lws_return_http_status(connection, status, why) < 0) return -1;
    return lws_http_transaction_completed(connection);
  }

  int begin_file(lws* connection, Download& download, const std::string& path) {
    if (!server_.is_named_by(connection))
      return refuse(connection, HTTP_STATUS_FORBIDDEN, ("open the page as " + server_.origin()).c_str());
    if (lws_hdr_total_length(connection, WSI_TOKEN_GET_URI) == 0)
      return refuse(connection, HTTP_STATUS_METHOD_NOT_ALLOWED, "only GET");
    const PageFile* const file = page_.find(path);
    if (file == nullptr) return refuse(connection, HTTP_STATUS_NOT_FOUND, "no such file");
    std::array<unsigned char, LWS_PRE + 2048> headers{};
    unsigned char* const start = headers.data() + LWS_PRE;
    unsigned char* at = start;
    unsigned char* const most = headers.data() + headers.size() - 1;
    if (lws_add_http_common_headers(connection, HTTP_STATUS_OK, file->type, file->content.size(), &at, most) != 0)
      return 1;
    for (const auto& [name, value] : kHeaders) {
      if (lws_add_http_header_by_name(connection, reinterpret_cast<const unsigned char*>(name),
                                      reinterpret_cast<const unsigned char*>(value),
                                      static_cast<int>(std::string_view(value).size()), &at, most) != 0)
        return 1;
    }
    if (lws_finalize_write_http_header(connection, start, &at, most) != 0) return 1;
    download = {file, 0};
    lws_callback_on_writable(connection);
    return 0;
  }

  int go_on_with_file(lws* connection, Download& download) {
    if (download.file == nullptr) return 0;
    const std::string& content = download.file->content;
    const std::size_t count = std::min(kChunk_bytes, content.size() - download.sent);
    const bool last = download.sent + count == content.size();
    if (!server_.write(connection, std::string_view(content).substr(download.sent, count),
                       last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP))
      return -1;
    download.sent += count;
    if (!last) {
      lws_callback_on_writable(connection);
      return 0;
    }
    download.file = nullptr;
    return lws_http_transaction_completed(connection) != 0 ? -1 : 0;
  }

  // Viewers.

  static int on_socket(lws* connection, lws_callback_reasons reason, void* user, void* in, std::size_t length) {
    Service& service = of(connection);
    auto* const session = static_cast<Session*>(user);
    switch (reason) {
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        if (service.server_.is_named_by(connection) && service.server_.is_own_page(connection) &&
            service.viewers_ < kMostViewers)
          return 0;
        ++service.refused_;
        return -1;
      case LWS_CALLBACK_ESTABLISHED:
        session->viewer = new Viewer(connection);
        service.all_.push_back(session->viewer);
        ++service.viewers_;
        lws_callback_on_writable(connection);
        return 0;
      case LWS_CALLBACK_RECEIVE:
        return service.receive(connection, *session->viewer, {static_cast<char*>(in), length});
      case LWS_CALLBACK_SERVER_WRITEABLE: return service.send_next(connection, *session->viewer);
      case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
        service.answer_one();
        lws_callback_on_writable_all_protocol(lws_get_context(connection), lws_get_protocol(connection));
        return 0;
      case LWS_CALLBACK_CLOSED:
        if (session != nullptr && session->viewer != nullptr) {
          std::erase(service.all_, session->viewer);
          delete std::exchange(session->viewer, nullptr);
          --service.viewers_;
        }
        return 0;
      default: return 0;
    }
  }

  int disconnect(lws* connection, lws_close_status status, std::string why) {
    ++refused_;
    return http::closed(connection, status, std::move(why));
  }

  int receive(lws* connection, Viewer& viewer, std::string_view part) {
    if (viewer.incoming.size() + part.size() > kLongestRequest_bytes)
      return disconnect(connection, LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE, "the request is too long");
    if (!http::is_whole(connection, viewer.incoming, part)) return 0;
    if (!viewer.allowance.take(Clock::now()))
      return disconnect(connection, LWS_CLOSE_STATUS_POLICY_VIOLATION, "too many requests");
    const std::optional<Request> request = parse_request(viewer.incoming);
    viewer.incoming.clear();
    if (!request) return disconnect(connection, LWS_CLOSE_STATUS_INVALID_PAYLOAD, "that is no request");
    take(viewer, *request);
    lws_callback_on_writable(connection);
    return 0;
  }

  void take(Viewer& viewer, const Request& request) {
    // A viewer that comes again after a while has saved up nothing.
    if (!viewer.waits()) viewer.served_s = std::max(viewer.served_s, serving_s_);
    switch (request.kind) {
      case Request::Kind::kHello:
        viewer.may_steer = equal_tokens(request.token, token_);
        viewer.tell(fmt::format("{{\"type\":\"grant\",\"steer\":{}}}", viewer.may_steer));
        return;
      case Request::Kind::kNext: viewer.wants_frame = true; return;
      case Request::Kind::kAt: viewer.at = request; return;
      case Request::Kind::kTrail:
      case Request::Kind::kRobot:
      case Request::Kind::kPlots:
      case Request::Kind::kPlot:
      case Request::Kind::kProgram:
      case Request::Kind::kOutside:
      case Request::Kind::kFlights:
      case Request::Kind::kFloors:
      case Request::Kind::kLight:
      case Request::Kind::kWork:
      case Request::Kind::kMarks: return viewer.ask(request);
      default: break;
    }
    if (!viewer.may_steer)
      return viewer.tell(notice_text("Steering needs the whole address that `kilotwin view` has printed."));
    const std::lock_guard lock(answering_);
    const std::string refusal = answers_ == nullptr ? "There is no run yet." : answers_->steer(request);
    if (!refusal.empty()) viewer.tell(refusal_text(refusal, request.kind == Request::Kind::kPlace));
  }

  /// Sends one message, the most urgent one.
  int send_next(lws* connection, Viewer& viewer) {
    const auto [message, binary] = next_message(viewer);
    if (!message) return 0;
    if (!server_.write(connection, *message, binary ? LWS_WRITE_BINARY : LWS_WRITE_TEXT)) return -1;
    bytes_ += message->size();
    if (binary) ++frames_;
    lws_callback_on_writable(connection);
    return 0;
  }

  struct Outgoing {
    Message message;
    bool binary = false;
  };

  [[nodiscard]] Outgoing next_message(Viewer& viewer) {
    {
      const std::lock_guard lock(mutex_);
      if (run_.message && viewer.run_seen != run_.number) {
        viewer.run_seen = run_.number;
        viewer.floors_seen = 0;
        viewer.at.reset();
        viewer.answered_frame.reset();
        return {run_.message};
      }
      if (status_.message && viewer.status_seen != status_.number) {
        viewer.status_seen = status_.number;
        return {status_.message};
      }
      if (viewer.wants_frame && frame_.message && viewer.frame_seen != frame_.number) {
        viewer.frame_seen = frame_.number;
        viewer.wants_frame = false;
        return {frame_.message, true};
      }
    }
    if (!viewer.lines.empty()) {
      Outgoing line{std::make_shared<const std::string>(std::move(viewer.lines.front()))};
      viewer.lines.pop_front();
      return line;
    }
    if (viewer.answered_frame) return {std::exchange(viewer.answered_frame, nullptr), true};
    if (viewer.waits() && has_answers_) server_.wake();
    return {};
  }

  /// Answers one request. Between two answers, the server reads what viewers have sent and writes to those that read. Fair queueing:
  /// of those who wait and read, the viewer whose answers have taken least time is next.
  void answer_one() {
    Viewer* next = nullptr;
    for (Viewer* const viewer : all_) {
      if (!viewer->waits() || !viewer->lines.empty() || viewer->answered_frame) continue;
      if (next != nullptr && next->served_s <= viewer->served_s) continue;
      if (lws_send_pipe_choked(viewer->connection) == 0) next = viewer;
    }
    if (next == nullptr) return;
    const std::lock_guard lock(answering_);
    if (answers_ == nullptr) return;
    serving_s_ = next->served_s;
    const double began_s = clock_();
    answer_in_line(*next);
    if (next->lines.empty()) answer_with_frame(*next);
    next->served_s += clock_() - began_s;
  }

  /// Turns requests into lines, until one has an answer. With answering_ held.
  void answer_in_line(Viewer& viewer) {
    if (viewer.at) {
      if (std::string floors = new_floors(viewer, viewer.at->tick); !floors.empty()) viewer.tell(std::move(floors));
      return;  // the frame comes first
    }
    while (const std::optional<Request> request = viewer.next_question()) {
      std::string line =
          request->kind == Request::Kind::kFloors ? new_floors(viewer, request->tick) : answer_to(*request);
      if (!line.empty()) return viewer.tell(std::move(line));
    }
  }

  /// Empty where the viewer knows them. With answering_ held.
  [[nodiscard]] std::string new_floors(Viewer& viewer, std::int64_t tick) {
    const std::uint64_t version = answers_->floors_version(tick);
    return std::exchange(viewer.floors_seen, version) == version ? std::string() : answers_->floors_at(tick);
  }

  /// With answering_ held.
  [[nodiscard]] std::string answer_to(const Request& request) {
    switch (request.kind) {
      case Request::Kind::kTrail: return answers_->trail(request.robot, request.tick);
      case Request::Kind::kRobot: return answers_->robot(request.robot, request.tick);
      case Request::Kind::kProgram: return answers_->program(request.robot, request.tick);
      case Request::Kind::kOutside: return answers_->outside(request.tick);
      case Request::Kind::kFlights: return answers_->flights(request.from, request.tick);
      case Request::Kind::kLight: return answers_->light(request.tick);
      case Request::Kind::kWork: return answers_->work();
      case Request::Kind::kMarks: return answers_->marks();
      case Request::Kind::kPlots: return answers_->plots();
      case Request::Kind::kPlot:
        return answers_->plot(request.number, request.of_robot ? std::optional(request.robot) : std::nullopt);
      default: return {};
    }
  }

  /// With answering_ held.
  void answer_with_frame(Viewer& viewer) {
    if (!viewer.at) return;
    std::string frame = answers_->frame_at(viewer.at->tick, viewer.at->number);
    viewer.at.reset();
    if (!frame.empty()) viewer.answered_frame = std::make_shared<const std::string>(std::move(frame));
  }

  const Clock_s clock_;
  const std::string token_;
  const PageFiles page_;
  std::atomic<std::uint32_t> viewers_{0};
  std::atomic<std::uint64_t> frames_{0}, bytes_{0}, refused_{0};
  std::vector<Viewer*> all_;  // of the server's thread, like what follows
  double serving_s_ = 0;      // `served_s` of the viewer that was answered last, before that
  mutable std::mutex mutex_;
  std::mutex answering_;        // held during calls of answers_
  Answers* answers_ = nullptr;  // guarded by answering_
  std::atomic<bool> has_answers_{false};
  http::Server server_;
};

Gateway::Gateway(const http::Endpoint& endpoint, std::string token, PageFiles page, Clock_s clock)
    : service_(std::make_unique<Service>(endpoint, std::move(token), std::move(page), std::move(clock))) {}
Gateway::~Gateway() = default;
std::uint16_t Gateway::port() const { return service_->port(); }
std::string Gateway::address() const { return service_->address(); }
void Gateway::show(Answers& answers, std::string run_text) { service_->show(answers, std::move(run_text)); }
void Gateway::post_status(std::string text) { service_->post(&Service::status_, std::move(text)); }
void Gateway::post_frame(std::string frame) { service_->post(&Service::frame_, std::move(frame)); }
Gateway::Traffic Gateway::traffic() const { return service_->traffic(); }

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw RunError("the system has no random numbers; expected getrandom() to give 16 octets");
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

}  // namespace kilotwin::view

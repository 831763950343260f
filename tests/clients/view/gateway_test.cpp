// The gateway over real sockets: what viewers get, who may steer, and that a hostile or stalled viewer costs itself alone.
#include "clients/view/gateway.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <cstring>
#include <fstream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>
#include <vector>

#include "clients/view/recorded_run.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "tests/clients/view/recordings.hpp"
#include "tests/clients/view/websocket_client.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::view {
namespace {

using nlohmann::json;
using test::WebSocketClient;

constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

/// A recording that notes how it was steered.
class NotedRun : public RecordedRun {
 public:
  using RecordedRun::RecordedRun;
  [[nodiscard]] std::string steer(const Request& request) override {
    if (request.kind == Request::Kind::kOverhead) packets.push_back(request.packet);
    if (request.kind == Request::Kind::kPlace) places.push_back(request.place);
    steered.push_back(request.kind);
    const bool refused = request.kind == Request::Kind::kStop || request.place.body == 19;
    return refused ? "not now" : "";
  }
  std::vector<OverheadPacket> packets;
  std::vector<Relocation> places;
  std::vector<Request::Kind> steered;  // of the gateway's thread; read it after an answer
};

/// A recording whose plots take long, by a clock of its own, and until the test lets them go on.
class HeldRun : public NotedRun {
 public:
  using NotedRun::NotedRun;
  [[nodiscard]] std::string plot(std::uint32_t number, std::optional<std::uint32_t> robot) override {
    std::unique_lock lock(mutex_);
    ++plots_begun_;
    now_s_ += .01 + 1e-5 * plots_begun_;  // no two viewers have taken the same time
    changed_.notify_all();
    changed_.wait_for(lock, kLongest, [this] { return allowed_ >= plots_begun_; });
    return NotedRun::plot(number, robot);
  }
  [[nodiscard]] std::string robot(std::uint32_t robot, std::int64_t tick) override {
    const std::lock_guard lock(mutex_);
    now_s_ += .0001;
    ++robots_answered_;
    changed_.notify_all();
    return NotedRun::robot(robot, tick);
  }
  [[nodiscard]] double now_s() const { return now_s_; }
  /// Waits until a plot is held.
  [[nodiscard]] bool holds_a_plot() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLongest, [this] { return plots_begun_ > allowed_; });
  }
  /// Lets the plot go on that is held. Returns once the next one is held, or a question about a robot has been answered: true.
  [[nodiscard]] bool next_answers_a_robot() {
    std::unique_lock lock(mutex_);
    const int before = robots_answered_;
    ++allowed_;
    changed_.notify_all();
    changed_.wait_for(lock, kLongest, [&] { return plots_begun_ > allowed_ || robots_answered_ > before; });
    return robots_answered_ > before;
  }
  void let_go(int plots) {
    const std::lock_guard lock(mutex_);
    allowed_ += plots;
    changed_.notify_all();
  }

 private:
  static constexpr std::chrono::seconds kLongest{90};
  std::mutex mutex_;
  std::condition_variable changed_;
  int plots_begun_ = 0, allowed_ = 0, robots_answered_ = 0;
  double now_s_ = 0;  // of the gateway's thread
};

class GatewayTest : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(scratch_.path() / "page/assets");
    test::write(scratch_ / "page/index.html", "<title>the page</title>");
    test::write(scratch_ / "page/assets/index.js", std::string(300000, 'j'));
    test::write(scratch_ / "secret.txt", "secret");
    test::write_circling(scratch_ / "r.ktrec", {.robots = 20, .states = 50, .floors = true});
    run_ = std::make_unique<NotedRun>(scratch_ / "r.ktrec");
    gateway_ = std::make_unique<Gateway>(0, kToken, PageFiles(scratch_.path() / "page"));
    gateway_->show(*run_, run_->text());
  }
  void TearDown() override { gateway_.reset(); }
  [[nodiscard]] std::uint16_t port() const { return gateway_->port(); }
  [[nodiscard]] std::string get(const std::string& path, const std::string& host = "127.0.0.1") const {
    return test::http(port(), "GET " + path + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n");
  }
  /// The gateway still serves others.
  void expect_alive() {
    WebSocketClient viewer(port());
    ASSERT_TRUE(viewer.open());
    viewer.send_text(R"({"do":"at","tick":1,"request":1})");
    EXPECT_TRUE(viewer.await("frame"));
  }
  test::Scratch scratch_;
  std::unique_ptr<NotedRun> run_;
  std::unique_ptr<Gateway> gateway_;
};

TEST_F(GatewayTest, ServesThePageAndNothingElse) {
  const std::string page = get("/");
  EXPECT_NE(page.find(" 200 "), std::string::npos);
  EXPECT_NE(page.find("<title>the page</title>"), std::string::npos);
  EXPECT_NE(page.find("content-security-policy: default-src 'none'"), std::string::npos);
  EXPECT_EQ(page.find(kToken), std::string::npos);
  EXPECT_NE(get("/assets/index.js").find(std::string(300000, 'j')), std::string::npos);
  for (const char* path : {"/../secret.txt", "/assets/../../secret.txt", "/%2e%2e/secret.txt", "//etc/passwd",
                           "/page", "/index.html/", "/assets"})
    EXPECT_EQ(get(path).find("secret"), std::string::npos) << path;
  EXPECT_NE(get("/nothing").find(" 404 "), std::string::npos);
  EXPECT_NE(
      test::http(port(), "POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
          .find(" 405 "),
      std::string::npos);
}

TEST_F(GatewayTest, RefusesOtherHostsAndOrigins) {
  EXPECT_NE(get("/", "evil.example").find(" 403 "), std::string::npos);
  EXPECT_NE(get("/", "127.0.0.1.evil.example:80").find(" 403 "), std::string::npos);
  EXPECT_NE(get("/", "localhost:9999").find(" 200 "), std::string::npos) << "a forwarded port";
  const std::string own = "http://127.0.0.1:" + std::to_string(port());
  EXPECT_TRUE(WebSocketClient(port(), {.origin = own}).open());
  for (const std::string& origin : {std::string("http://evil.example"), std::string("null"), own + "0",
                                    std::string("https://127.0.0.1:") + std::to_string(port())})
    EXPECT_FALSE(WebSocketClient(port(), {.origin = origin}).open()) << origin;
  EXPECT_FALSE(WebSocketClient(port(), {.host = "evil.example"}).open());
  EXPECT_FALSE(WebSocketClient(port(), {.protocol = "other"}).open());
  EXPECT_FALSE(WebSocketClient(port(), {.protocol = ""}).open());
  EXPECT_GE(gateway_->traffic().refused, 8u);
  expect_alive();
}

/// Browsers send the name in small letters, however --listen has it.
TEST_F(GatewayTest, ItsNameMayHaveCapitals) {
  http::Endpoint endpoint;
  endpoint.host = "LocalHost";
  gateway_ = std::make_unique<Gateway>(endpoint, kToken, PageFiles(scratch_.path() / "page"));
  gateway_->show(*run_, run_->text());
  const std::string own = "http://localhost:" + std::to_string(port());
  EXPECT_NE(get("/", own.substr(7)).find(" 200 "), std::string::npos);
  EXPECT_NE(get("/", "evil.example").find(" 403 "), std::string::npos);
  EXPECT_TRUE(WebSocketClient(port(), {.host = "localhost", .origin = own}).open());
}

TEST_F(GatewayTest, AnswersWithTheStateAtATick) {
  WebSocketClient viewer(port());
  const auto run = viewer.await("run");
  ASSERT_TRUE(run);
  EXPECT_EQ(json::parse(run->payload)["robots"], 20);
  viewer.send_text(R"({"do":"at","tick":100,"request":5})");
  ASSERT_TRUE(viewer.await("floors")) << "floors come before the first frame";
  const auto frame = viewer.await("frame");
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->payload, run_->frame_at(100, 5));
  viewer.send_text(R"({"do":"robot","robot":1,"tick":100})");
  EXPECT_TRUE(viewer.await("robot"));
  viewer.send_text(R"({"do":"trail","robot":1,"tick":100})");
  EXPECT_TRUE(viewer.await("trail"));
  for (const char* kind : {"work", "marks"}) {
    viewer.send_text(std::string(R"({"do":")") + kind + "\"}");
    EXPECT_TRUE(viewer.await(kind)) << kind;
  }
  viewer.send_text(R"({"do":"flights","from":-1,"tick":100})");
  EXPECT_TRUE(viewer.await("flights"));
}

TEST_F(GatewayTest, GivesEveryViewerTheNewestLiveStateOncePerRequest) {
  WebSocketClient viewer(port());
  ASSERT_TRUE(viewer.await("run"));
  viewer.send_text(R"({"do":"next"})");
  gateway_->post_frame("first");
  ASSERT_TRUE(viewer.await("frame"));
  for (int i = 0; i < 1000; ++i) gateway_->post_frame("state " + std::to_string(i));
  viewer.send_text(R"({"do":"next"})");
  const auto newest = viewer.await("frame");
  ASSERT_TRUE(newest);
  EXPECT_EQ(newest->payload, "state 999") << "what was missed is not made up for";
  viewer.send_text(R"({"do":"next"})");
  EXPECT_FALSE(viewer.await("frame", 0.3)) << "the same state twice";
}

TEST_F(GatewayTest, OnlyTheTokenAllowsToSteer) {
  WebSocketClient viewer(port());
  viewer.send_text(R"({"do":"pause"})");
  ASSERT_TRUE(viewer.await("notice"));
  for (const char* wrong : {"", "0", "0123456789abcdef0123456789abcdee", "0123456789abcdef0123456789abcdef0"}) {
    viewer.send_text(std::string(R"({"do":"hello","token":")") + wrong + "\"}");
    EXPECT_NE(viewer.await("grant")->payload.find("false"), std::string::npos);
    viewer.send_text(R"({"do":"stop"})");
    ASSERT_TRUE(viewer.await("notice"));
  }
  EXPECT_TRUE(run_->steered.empty());
  viewer.send_text(std::string(R"({"do":"hello","token":")") + kToken + "\"}");
  EXPECT_NE(viewer.await("grant")->payload.find("true"), std::string::npos);
  viewer.send_text(R"({"do":"pause"})");
  viewer.send_text(R"({"do":"overhead","command":6,"message":"0a0000000000000000ff"})");
  viewer.send_text(R"({"do":"place","robot":3,"x":-12.5,"y":40,"heading":7})");
  viewer.send_text(R"({"do":"place","movable":1,"x":1,"y":2,"heading":-1})");
  viewer.send_text(R"({"do":"stop"})");
  const auto refusal = viewer.await("notice");
  ASSERT_TRUE(refusal);
  EXPECT_NE(refusal->payload.find("not now"), std::string::npos);
  EXPECT_EQ(json::parse(refusal->payload)["refuses"], "");
  viewer.send_text(R"({"do":"place","robot":19,"x":0,"y":0,"heading":0})");
  EXPECT_EQ(json::parse(viewer.await("notice")->payload)["refuses"], "place");
  EXPECT_EQ(run_->steered, (std::vector{Request::Kind::kPause, Request::Kind::kOverhead, Request::Kind::kPlace,
                                        Request::Kind::kPlace, Request::Kind::kStop, Request::Kind::kPlace}));
  ASSERT_EQ(run_->places.size(), 3u);
  EXPECT_EQ(run_->places[0].body, 3u);
  EXPECT_EQ(run_->places[0].pose.x_mm, -12.5);
  EXPECT_NEAR(run_->places[0].pose.heading_rad, 7 - 2 * kPi, 1e-12);
  EXPECT_TRUE(run_->places[1].movable);
  EXPECT_EQ(run_->packets.at(0).message[9], 255);
  EXPECT_NE(gateway_->address().find(kToken), std::string::npos);
}

TEST_F(GatewayTest, DisconnectsWhoBreaksTheRules) {
  const auto closing = [&](const auto& act) {
    WebSocketClient viewer(port());
    EXPECT_TRUE(viewer.open());
    act(viewer);
    return viewer.closed();
  };
  EXPECT_EQ(closing([](WebSocketClient& v) { v.send_text("hello?"); }), 1007);
  for (const char* wrong :
       {R"({"do":"overhead","command":6,"message":"0a"})",
        R"({"do":"overhead","command":4,"message":"0a0000000000000000ff"})",
        R"({"do":"overhead","command":6,"message":"zz0000000000000000ff"})", R"({"do":"plot"})",
        R"({"do":"plot","plot":1,"robot":-1})", R"({"do":"program","robot":1})",
        R"({"do":"place","x":1,"y":1,"heading":0})", R"({"do":"place","robot":1,"x":"1","y":1,"heading":0})",
        R"({"do":"place","robot":-1,"x":1,"y":1,"heading":0})", R"({"do":"place","robot":1,"x":1,"y":1})",
        R"({"do":"flights","tick":5})"})
    EXPECT_EQ(closing([wrong](WebSocketClient& v) { v.send_text(wrong); }), 1007) << wrong;
  EXPECT_EQ(closing([](WebSocketClient& v) { v.send_frame(2, std::string(40, '\0')); }), 1007);
  EXPECT_EQ(closing([](WebSocketClient& v) { v.send_text(std::string(100000, ' ')); }), 1009);
  EXPECT_EQ(closing([](WebSocketClient& v) {
              for (int i = 0; i < 200; ++i) v.send_frame(i == 0 ? 1 : 0, "0123456789", false);
            }),
            1009)
      << "fragments without an end";
  EXPECT_EQ(closing([](WebSocketClient& v) {
              for (int i = 0; i < 3000; ++i) v.send_text(R"({"do":"next"})");
            }),
            1008);
  // A frame that claims 2^62 octets, and frames of no kind.
  EXPECT_GE(closing([](WebSocketClient& v) {
              v.send_bytes(std::string("\x81\xff\x40\0\0\0\0\0\0\0aaaa", 14) + std::string(2000, 'x'));
            }),
            0);
  EXPECT_GE(closing([](WebSocketClient& v) { v.send_frame(11, "??"); }), 0);
  expect_alive();
}

TEST_F(GatewayTest, SurvivesAnyBytesAfterTheHandshake) {
  std::mt19937 random(5);
  for (int round = 0; round < 60; ++round) {
    WebSocketClient viewer(port());
    std::string bytes(1 + random() % 600, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (round % 2) bytes[0] = '\x81';
    viewer.send_bytes(bytes);
  }
  expect_alive();
}

TEST_F(GatewayTest, SurvivesHalfARequestOverHttp) {
  std::vector<std::unique_ptr<WebSocketClient>> silent;
  for (int i = 0; i < 150; ++i) {
    // Connections that say nothing more; the handshake is for another protocol, so that they cost the server least.
    silent.push_back(std::make_unique<WebSocketClient>(port(), WebSocketClient::Handshake{.protocol = "none"}));
  }
  EXPECT_NE(get("/").find(" 200 "), std::string::npos);
  EXPECT_EQ(test::http(port(), "GET / HTTP/1.1\r\nHost: localhost\r\n" + std::string(100000, 'a')).find("secret"),
            std::string::npos);
  expect_alive();
}

TEST_F(GatewayTest, AcceptsNoMoreViewersThanItCanServe) {
  std::vector<std::unique_ptr<WebSocketClient>> viewers;
  for (std::uint32_t i = 0; i < kMostViewers; ++i) viewers.push_back(std::make_unique<WebSocketClient>(port()));
  EXPECT_TRUE(viewers.back()->open());
  EXPECT_FALSE(WebSocketClient(port()).open());
  viewers.pop_back();
  EXPECT_TRUE(test::eventually([&] { return gateway_->traffic().viewers < kMostViewers; }));
  expect_alive();
}

TEST_F(GatewayTest, AStalledViewerDelaysNobodyAndIsSentNoMore) {
  WebSocketClient stalled(port()), viewer(port());
  ASSERT_TRUE(viewer.await("run"));
  const std::string large(700000, 'x');  // a state of 100,000 robots
  for (int i = 0; i < 400; ++i) stalled.send_text(R"({"do":"next"})");
  for (int i = 0; i < 200; ++i) {
    gateway_->post_frame(large + std::to_string(i));
    viewer.send_text(R"({"do":"next"})");
    const auto frame = viewer.await("frame");
    ASSERT_TRUE(frame) << i;
    EXPECT_EQ(frame->payload.substr(large.size()), std::to_string(i));
  }
  // It asked 400 times without reading: at most what fits into the sockets was sent to it.
  EXPECT_LT(gateway_->traffic().bytes, 200 * large.size() + 40 * large.size());
}

TEST_F(GatewayTest, WhoAsksExpensiveQuestionsWaitsForTheOthers) {
  HeldRun run(scratch_ / "r.ktrec");
  Gateway gateway(0, kToken, PageFiles(scratch_.path() / "page"), [&run] { return run.now_s(); });
  gateway.show(run, run.text());
  constexpr int kGreedy = 12, kQuestions = 8, kRounds = 10;
  std::vector<std::unique_ptr<WebSocketClient>> greedy;
  for (int i = 0; i < kGreedy; ++i) greedy.push_back(std::make_unique<WebSocketClient>(gateway.port()));
  WebSocketClient viewer(gateway.port());
  ASSERT_TRUE(viewer.await("run"));
  for (const auto& one : greedy)
    for (int i = 0; i < kQuestions; ++i) one->send_text(R"({"do":"plot","plot":0})");
  int plots = 0;  // that were answered while the viewer's question waited
  for (int i = 0; i < kRounds; ++i) {
    ASSERT_TRUE(run.holds_a_plot());
    viewer.send_text(R"({"do":"robot","robot":1,"tick":100})");
    do ++plots;
    while (!run.next_answers_a_robot() && plots < kGreedy * kQuestions / 2);
    run.let_go(1);  // the answer is written before the second one that follows
    ASSERT_TRUE(viewer.await("robot"));
  }
  // At first all are new and take turns; later, the plot that is held goes on, and one or two that have taken less time.
  EXPECT_LE(plots, kGreedy + 3 * kRounds) << "not one of each greedy viewer per answer";
  // Nobody starves: all greedy ones get their answers.
  run.let_go(kGreedy * kQuestions);
  for (const auto& one : greedy) EXPECT_TRUE(one->await("plot"));
}

TEST_F(GatewayTest, AViewerThatDoesNotReadItsAnswersHoldsUpNobody) {
  WebSocketClient stalled(port()), viewer(port());
  ASSERT_TRUE(viewer.await("run"));
  ASSERT_TRUE(stalled.await("run"));
  // Long answers that it never reads, until the sockets are full: then it waits with answers that took least time.
  for (int i = 0; i < 400; ++i) {
    stalled.send_text(R"({"do":"flights","from":-1,"tick":100000})");
    stalled.send_text(R"({"do":"trail","robot":1,"tick":100000})");
    if (i % 100 == 99) {
      viewer.send_text(R"({"do":"robot","robot":1,"tick":100})");
      ASSERT_TRUE(viewer.await("robot")) << i;
    }
  }
}

TEST_F(GatewayTest, TellsAllViewersOfTheNextRun) {
  WebSocketClient viewer(port());
  ASSERT_TRUE(viewer.await("run"));
  test::write_circling(scratch_ / "next.ktrec", {.robots = 7, .states = 3});
  NotedRun next(scratch_ / "next.ktrec");
  gateway_->show(next, next.text());
  const auto run = viewer.await("run");
  ASSERT_TRUE(run);
  EXPECT_EQ(json::parse(run->payload)["robots"], 7);
  gateway_.reset();  // before the run that answers
}

TEST(Gateway, RefusesAPortThatIsTaken) {
  test::Scratch scratch;
  test::write(scratch / "index.html", "");
  const Gateway first(0, kToken, PageFiles(scratch.path()));
  EXPECT_THROW(Gateway(first.port(), kToken, PageFiles(scratch.path())), UserError);
  EXPECT_THROW(PageFiles(scratch.path() / "none"), UserError);
  EXPECT_EQ(random_token().size(), 32u);
  EXPECT_NE(random_token(), random_token());
}

}  // namespace
}  // namespace kilotwin::view

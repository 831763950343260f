// The stream over real sockets: what arrives is what was posted, and a client that does not read delays nobody.
#include "clients/cameras/mjpeg_server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include "core/base/error.hpp"
#include "core/os/descriptor.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::cameras {
namespace {

class Client {
 public:
  Client(std::uint16_t port, const std::string& path) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const std::string request = fmt::format("GET {} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", path);
    EXPECT_EQ(send(socket_.get(), request.data(), request.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(request.size()));
  }
  /// Reads until the answer holds `text`.
  bool reads(const std::string& text) {
    return test::eventually([&] {
      pollfd waiting{socket_.get(), POLLIN, 0};
      while (poll(&waiting, 1, 0) > 0) {
        std::array<char, 65536> buffer;
        const ssize_t count = recv(socket_.get(), buffer.data(), buffer.size(), 0);
        if (count <= 0) break;
        answer_.append(buffer.data(), static_cast<std::size_t>(count));
      }
      return answer_.find(text) != std::string::npos;
    });
  }
  [[nodiscard]] const std::string& answer() const { return answer_; }

 private:
  os::Descriptor socket_;
  std::string answer_;
};

/// Of a size and a content by its number, with an end that can be looked for.
std::string picture(int number, std::size_t size) {
  return fmt::format("<{}>", number) + std::string(size, static_cast<char>('a' + number % 26)) +
         fmt::format("</{}>", number);
}

TEST(MjpegServer, ServesThePageThePictureAndTheStream) {
  MjpegServer server(0);
  Client none(server.port(), "/picture.jpg");
  EXPECT_TRUE(none.reads(" 503"));
  server.post(picture(1, 300000), {1, 0, 0, 0, 123456789});
  Client page(server.port(), "/");
  EXPECT_TRUE(page.reads("<img src=\"/camera.mjpg\""));
  Client single(server.port(), "/picture.jpg");
  EXPECT_TRUE(single.reads("</1>"));
  EXPECT_NE(single.answer().find(picture(1, 300000)), std::string::npos);
  EXPECT_TRUE(Client(server.port(), "/elsewhere").reads(" 404"));

  Client stream(server.port(), "/camera.mjpg");
  EXPECT_TRUE(stream.reads("</1>"));
  EXPECT_NE(stream.answer().find("multipart/x-mixed-replace"), std::string::npos);
  EXPECT_NE(stream.answer().find("X-Capture-Unix-Ns: 123456789"), std::string::npos);
  EXPECT_EQ(server.clients(), 1u);
  for (int number = 2; number < 20; ++number) {
    server.post(picture(number, 200000), {});
    EXPECT_TRUE(stream.reads(fmt::format("</{}>", number)));
    EXPECT_NE(stream.answer().find(picture(number, 200000)), std::string::npos);
  }
}

TEST(MjpegServer, ASlowClientMissesPicturesAndDelaysNobody) {
  MjpegServer server(0);
  server.post(picture(0, 1000), {});
  Client slow(server.port(), "/camera.mjpg"), quick(server.port(), "/camera.mjpg");
  ASSERT_TRUE(slow.reads("</0>"));
  ASSERT_TRUE(quick.reads("</0>"));
  // 60 MB: far more than sockets hold. The slow client reads nothing meanwhile.
  constexpr int kPictures = 60;
  for (int number = 1; number <= kPictures; ++number) {
    server.post(picture(number, 1000000), {});
    ASSERT_TRUE(quick.reads(fmt::format("</{}>", number))) << number;
  }
  // Once it reads again, it sees the newest one, and has missed some.
  EXPECT_TRUE(slow.reads(fmt::format("</{}>", kPictures)));
  EXPECT_LT(slow.answer().size(), 40u * 1000000);
}

TEST(MjpegServer, APortThatIsTakenIsRefused) {
  const MjpegServer server(0);
  EXPECT_THROW(MjpegServer(server.port()), UserError);
}

}  // namespace
}  // namespace kilotwin::cameras

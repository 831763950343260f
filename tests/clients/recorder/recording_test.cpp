#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <random>
#include <thread>

#include "clients/recorder/export.hpp"
#include "clients/recorder/observables.hpp"
#include "clients/recorder/picture.hpp"
#include "clients/recorder/reader.hpp"
#include "core/base/error.hpp"
#include "tests/clients/recorder/synthetic.hpp"

namespace kilotwin::recorder {
namespace {

std::string error_of(const std::filesystem::path& file) {
  try {
    const Reader reader(file);
  } catch (const UserError& error) {
    return error.what();
  }
  return {};
}

/// End of each frame in the file, the header's first.
std::vector<std::size_t> frame_ends(const std::string& bytes) {
  std::vector<std::size_t> ends;
  for (std::size_t at = 0; at + kFramePrefix_bytes <= bytes.size();) {
    std::uint32_t length = 0;
    for (std::size_t i = 0; i < 4; ++i)
      length |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << 8 * i;
    at += kFramePrefix_bytes + length;
    ends.push_back(at);
  }
  return ends;
}

TEST(Recording, ReadsBackItsRecords) {
  const Scratch scratch;
  const auto header = synthetic_header(7);
  write_synthetic(scratch / "r.ktrec", header, 100);
  Reader reader(scratch / "r.ktrec");
  EXPECT_EQ(reader.header().SerializeAsString(), header.SerializeAsString());
  std::vector<std::int64_t> states;
  std::int64_t hashes = 0;
  int inputs = 0, messages = 0, ends = 0;
  while (const proto::Record* record = reader.next()) {
    if (record->has_state()) {
      const proto::StateRecord& state = record->state();
      const SyntheticState expected(7, Tick{state.tick()});
      states.push_back(state.tick());
      EXPECT_TRUE(std::equal(state.x_mm().begin(), state.x_mm().end(), expected.x_mm.begin(), expected.x_mm.end()));
      EXPECT_TRUE(std::equal(state.y_mm().begin(), state.y_mm().end(), expected.y_mm.begin(), expected.y_mm.end()));
      EXPECT_TRUE(std::equal(state.heading_rad().begin(), state.heading_rad().end(), expected.heading_rad.begin()));
      EXPECT_EQ(state.led(), std::string(expected.led.begin(), expected.led.end()));
      EXPECT_EQ(state.life_cycle(), std::string(expected.life_cycle.begin(), expected.life_cycle.end()));
    } else if (record->has_hash()) {
      EXPECT_EQ(record->hash().first_tick(), hashes);
      for (const std::uint64_t chain : record->hash().chain()) EXPECT_EQ(chain, synthetic_hash(hashes++));
    } else if (record->has_input()) {
      ++inputs;
      EXPECT_EQ(record->input().kind(), proto::InputRecord::PAUSE);
    } else if (record->has_messages()) {
      ++messages;
      EXPECT_EQ(record->messages().count_size(), 3);
    } else {
      ++ends;
      EXPECT_EQ(record->end().tick(), 100);
      EXPECT_EQ(record->end().state_hash(), synthetic_hash(100));
    }
  }
  EXPECT_EQ(states, (std::vector<std::int64_t>{0, 31, 62, 92, 100}));  // ceil(k / 0.032768), and the last tick
  EXPECT_EQ(hashes, 101);
  EXPECT_EQ(inputs, 1);
  EXPECT_EQ(messages, 1);
  EXPECT_EQ(ends, 1);
  EXPECT_TRUE(reader.ended());
  EXPECT_EQ(reader.warning(), "");
  reader.rewind();
  EXPECT_FALSE(reader.ended());
  ASSERT_NE(reader.next_state(), nullptr);
  EXPECT_EQ(reader.next_state()->tick(), 31);
}

TEST(Recording, ManyHashesAndLargeStatesKeepTheirOrder) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(20'000, 100), 10'000);
  Reader reader(scratch / "r.ktrec");
  std::int64_t hashes = 0, states = 0;
  while (const proto::Record* record = reader.next()) {
    if (record->has_state()) ++states;
    if (!record->has_hash()) continue;
    EXPECT_EQ(record->hash().first_tick(), hashes);
    hashes += record->hash().chain_size();
  }
  EXPECT_EQ(hashes, 10'001);
  EXPECT_EQ(states, 5);  // at 0, 100, 200, 300 s and at the end, 327.68 s
  EXPECT_TRUE(reader.ended());
}

TEST(Recording, RepeatedTicksAreRecordedOnce) {
  const Scratch scratch;
  Writer writer(scratch / "r.ktrec", synthetic_header(2));
  for (const std::int64_t t : {0, 1, 2, 3, 2, 3, 4}) {
    writer.hash(Tick{t}, synthetic_hash(t));
    writer.state(SyntheticState(2, Tick{t}).view(Tick{t}));
  }
  writer.end(Tick{4}, 1);
  Reader reader(scratch / "r.ktrec");
  std::int64_t hashes = 0, states = 0;
  while (const proto::Record* record = reader.next()) {
    if (record->has_state()) {
      EXPECT_EQ(record->state().tick(), states++);
    }
    if (record->has_hash()) hashes += record->hash().chain_size();
  }
  EXPECT_EQ(states, 5);
  EXPECT_EQ(hashes, 5);
}

TEST(Recording, TailCutAtEachByteIsReadUpToTheLastWholeFrame) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(3), 70);
  const std::string bytes = content(scratch / "r.ktrec");
  const std::vector<std::size_t> ends = frame_ends(bytes);
  ASSERT_EQ(ends.back(), bytes.size());
  const auto cut = scratch / "cut.ktrec";
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    put_content(cut, bytes.substr(0, length));
    if (length < ends[0]) {
      const std::string error = error_of(cut);
      EXPECT_EQ(error.rfind(cut.string() + ": not a Kilotwin recording; ", 0), 0u) << error;
      continue;
    }
    Reader reader(cut);
    std::size_t records = 0;
    while (reader.next() != nullptr) ++records;
    std::size_t whole = 0;
    while (ends[whole + 1] <= length) ++whole;
    ASSERT_EQ(records, whole);
    EXPECT_FALSE(reader.ended());
    EXPECT_FALSE(reader.damaged());
    if (ends[whole] == length) {
      EXPECT_EQ(reader.warning(), "");
    } else {
      EXPECT_EQ(reader.warning(),
                cut.string() + ": cut off at byte " + std::to_string(ends[whole]) + "; read up to there");
    }
  }
}

TEST(Recording, EachFlippedBitIsNoticed) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(2), 40);
  const std::string bytes = content(scratch / "r.ktrec");
  const std::vector<std::size_t> ends = frame_ends(bytes);
  const auto flipped = scratch / "flipped.ktrec";
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    std::string wrong = bytes;
    wrong[bit / 8] = static_cast<char>(wrong[bit / 8] ^ 1 << bit % 8);
    put_content(flipped, wrong);
    if (bit / 8 < ends[0]) {
      EXPECT_NE(error_of(flipped), "") << "bit " << bit;
      continue;
    }
    Reader reader(flipped);
    std::size_t records = 0;
    while (reader.next() != nullptr) ++records;
    std::size_t before = 0;
    while (ends[before + 1] <= bit / 8) ++before;
    ASSERT_EQ(records, before) << "bit " << bit;
    EXPECT_TRUE(reader.damaged()) << "bit " << bit;
    EXPECT_NE(reader.warning().find("at byte " + std::to_string(ends[before])), std::string::npos)
        << reader.warning();
  }
}

void use_in_every_way(const std::filesystem::path& file, const Scratch& scratch) {
  for (const int way : {0, 1, 2, 3, 4}) {
    try {
      Reader reader(file);
      if (way == 0) export_trajectories(reader, scratch / "t.csv");
      if (way == 1) export_messages(reader, scratch / "m.csv");
      if (way == 2) {
        const std::string svg = picture_svg(read_overview(reader));
        EXPECT_EQ(svg.find("nan"), std::string::npos);
        EXPECT_EQ(svg.substr(svg.size() - 7), "</svg>\n");
      }
      if (way == 3) {
        const ObservableCurves curves = observe(reader);
        for (const double msd : curves.of(Observable::kMsd)) EXPECT_TRUE(std::isfinite(msd));
      }
      if (way == 4) {
        while (reader.next() != nullptr) EXPECT_EQ(reader.warning(), "");
        EXPECT_TRUE(reader.ended() || reader.warning().empty() ||
                    reader.warning().find(" at byte ") != std::string::npos);
      }
    } catch (const UserError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

TEST(Recording, FuzzedFilesGiveDataOrOneErrorLine) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(5), 95);
  const std::string bytes = content(scratch / "r.ktrec");
  const std::vector<std::size_t> ends = frame_ends(bytes);
  std::mt19937_64 random(1);
  const auto fuzzed = scratch / "fuzzed.ktrec";
  for (int round = 0; round < 1500; ++round) {
    std::string wrong;
    if (round % 3 == 0) {
      // Random bytes after a valid header.
      wrong = bytes.substr(0, ends[random() % 2]);
      for (std::uint64_t i = random() % 300; i > 0; --i) wrong += static_cast<char>(random());
    } else {
      // Records with wrong bytes and a correct checksum, as another writer could produce.
      std::size_t from = 0;
      for (const std::size_t end : ends) {
        std::string record = bytes.substr(from + kFramePrefix_bytes, end - from - kFramePrefix_bytes);
        if (random() % 3 == 0) {
          for (std::uint64_t i = random() % 4 + 1; i > 0; --i)
            record[random() % record.size()] = static_cast<char>(random());
        }
        if (random() % 8 == 0) record.resize(random() % record.size() + 1);
        wrong += framed(record);
        from = end;
      }
    }
    put_content(fuzzed, wrong);
    use_in_every_way(fuzzed, scratch);
  }
}

TEST(Recording, WrongStatesUnderARightChecksumAreRefused) {
  const Scratch scratch;
  const auto file = scratch / "r.ktrec";
  proto::Record header;
  *header.mutable_header() = synthetic_header(2);
  proto::Record right;
  proto::StateRecord& state = *right.mutable_state();
  state.set_tick(4);
  for (int i = 0; i < 2; ++i) {
    state.add_x_mm(1);
    state.add_y_mm(2);
    state.add_heading_rad(3);
  }
  state.set_led("ab");
  state.set_life_cycle("ab");
  const auto warning_with = [&](const proto::Record& second) {
    put_content(file, framed(header.SerializeAsString()) + framed(right.SerializeAsString()) +
                          framed(second.SerializeAsString()));
    Reader reader(file);
    EXPECT_NE(reader.next(), nullptr);
    EXPECT_EQ(reader.next(), nullptr);
    return reader.warning();
  };
  proto::Record wrong = right;
  EXPECT_NE(warning_with(wrong).find("out of order"), std::string::npos);
  wrong.mutable_state()->set_tick(5);
  wrong.mutable_state()->add_x_mm(1);
  EXPECT_NE(warning_with(wrong).find("another number of robots"), std::string::npos);
  wrong = right;
  wrong.mutable_state()->set_tick(5);
  wrong.mutable_state()->set_y_mm(1, std::nan(""));
  EXPECT_NE(warning_with(wrong).find("pose out of range"), std::string::npos);
  EXPECT_NE(warning_with(header).find("second header"), std::string::npos);
  proto::Record messages;
  messages.mutable_messages()->add_receiver(2);
  messages.mutable_messages()->add_sender(0);
  messages.mutable_messages()->add_count(1);
  EXPECT_NE(warning_with(messages).find("robots that do not exist"), std::string::npos);
}

TEST(Recording, RecordsOfUnknownKindsAreSkipped) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(2), 10);
  const std::string bytes = content(scratch / "r.ktrec");
  const std::size_t first = frame_ends(bytes)[0];
  // Field 200, length-delimited, three bytes.
  put_content(scratch / "r.ktrec", bytes.substr(0, first) +
                                       framed("\xc2\x0c\x03"
                                              "abc") +
                                       bytes.substr(first));
  Reader reader(scratch / "r.ktrec");
  ASSERT_NE(reader.next_state(), nullptr);
  while (reader.next() != nullptr) {}
  EXPECT_TRUE(reader.ended());
}

TEST(Recording, OtherFilesAreRefusedInOneLine) {
  const Scratch scratch;
  const auto file = scratch / "f";
  EXPECT_EQ(error_of(file),
            file.string() +
                ": cannot be read: No such file or directory; expected a run directory or its recording.ktrec");
  put_content(file, "");
  EXPECT_NE(error_of(file).find(": not a Kilotwin recording; it is empty"), std::string::npos);
  put_content(file, "time_s,robot,x_mm,y_mm\n0,1,2,3\n");
  EXPECT_NE(error_of(file).find(": not a Kilotwin recording; "), std::string::npos);
  EXPECT_NE(error_of(scratch.path()).find(": not a Kilotwin recording; "), std::string::npos);
  EXPECT_NE(error_of("/dev/zero").find(": not a Kilotwin recording; "), std::string::npos);
  proto::Record newer;
  *newer.mutable_header() = synthetic_header(2);
  newer.mutable_header()->set_format(3);
  put_content(file, framed(newer.SerializeAsString()));
  EXPECT_EQ(error_of(file),
            file.string() + ": not a Kilotwin recording; it has format 3, this program reads format 2");
  // Format 1: length and CRC, without a checksum of both.
  std::string older = framed(newer.SerializeAsString());
  older.erase(8, 4);
  put_content(file, older);
  EXPECT_EQ(error_of(file),
            file.string() +
                ": not a Kilotwin recording; it has format 1 of an older version, this one reads format "
                "2; run the experiment again");
}

TEST(Recording, IsReadWhileItGrows) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(3), 64);
  const std::string bytes = content(scratch / "r.ktrec");
  const std::size_t first = frame_ends(bytes)[0];
  const auto growing = scratch / "growing.ktrec";
  put_content(growing, bytes.substr(0, first));
  Reader reader(growing);
  std::size_t records = 0;
  for (std::size_t at = first; at < bytes.size();) {
    while (reader.next() != nullptr) ++records;
    EXPECT_FALSE(reader.ended());
    const std::string more = bytes.substr(at, 37);
    std::ofstream(growing, std::ios::binary | std::ios::app) << more;
    at += more.size();
  }
  while (reader.next() != nullptr) ++records;
  EXPECT_EQ(records, frame_ends(bytes).size() - 1);
  EXPECT_TRUE(reader.ended());
  EXPECT_EQ(reader.warning(), "");
}

TEST(Writer, RefusesAFileThatExists) {
  const Scratch scratch;
  put_content(scratch / "r.ktrec", "precious");
  EXPECT_THROW(Writer(scratch / "r.ktrec", synthetic_header(1)), RunError);
  EXPECT_EQ(content(scratch / "r.ktrec"), "precious");
}

TEST(Writer, IsNotInheritedByOtherPrograms) {
  const Scratch scratch;
  const Writer writer(scratch / "r.ktrec", synthetic_header(1));
  bool found = false;
  for (int descriptor = 0; descriptor < 64; ++descriptor) {
    const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
    std::error_code none;
    if (std::filesystem::read_symlink(link, none) != scratch / "r.ktrec") continue;
    found = true;
    EXPECT_NE(::fcntl(descriptor, F_GETFD) & FD_CLOEXEC, 0);
  }
  EXPECT_TRUE(found);
}

/// Runs `work` in a child process and returns its exit status, or minus the signal that ended it.
template <class Work> int in_child(Work work) {
  const pid_t child = ::fork();
  if (child == 0) {
    work();
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

TEST(Writer, RecordsOlderThanASecondSurviveAKilledProcess) {
  const Scratch scratch;
  const auto file = scratch / "r.ktrec";
  const int status = in_child([&] {
    Writer writer(file, synthetic_header(2));
    for (std::int64_t t = 0; t < 150; ++t) {
      writer.hash(Tick{t}, synthetic_hash(t));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ::raise(SIGKILL);
  });
  EXPECT_EQ(status, -SIGKILL);
  Reader reader(file);
  std::int64_t hashes = 0;
  while (const proto::Record* record = reader.next()) hashes += record->hash().chain_size();
  EXPECT_EQ(reader.warning(), "");
  EXPECT_GE(hashes, 50);  // those of the first half second at least; the process runs for 1.5 s
}

TEST(Writer, RecordsBeyond256KiBSurviveAKilledProcess) {
  const Scratch scratch;
  const auto file = scratch / "r.ktrec";
  constexpr std::uint32_t kRobots = 1000;
  constexpr std::int64_t kStates = 40;
  const int status = in_child([&] {
    Writer writer(file, synthetic_header(kRobots));
    for (std::int64_t t = 0; t < kStates; ++t) writer.state(SyntheticState(kRobots, Tick{t}).view(Tick{t}));
    ::raise(SIGKILL);
  });
  EXPECT_EQ(status, -SIGKILL);
  Reader reader(file);
  std::int64_t states = 0;
  while (reader.next_state() != nullptr) ++states;
  EXPECT_GE(states, kStates - 256 * 1024 / (26 * kRobots) - 1);
}

TEST(Writer, ReportsAFullDiskAndContinuesWhenThereIsSpace) {
  const Scratch scratch;
  const auto file = scratch / "r.ktrec";
  // A limit on file size stands for a full disk: a write is cut short, then fails.
  const int status = in_child([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit little{10'000, RLIM_INFINITY}, much{RLIM_INFINITY, RLIM_INFINITY};
    ::setrlimit(RLIMIT_FSIZE, &little);
    Writer writer(file, synthetic_header(100));
    std::string line;
    for (std::int64_t t = 0; t < 10; ++t) {
      writer.state(SyntheticState(100, Tick{t}).view(Tick{t}));
      try {
        writer.flush();
      } catch (const RunError& error) {
        line = error.what();
      }
    }
    if (line != file.string() + ": cannot be written: File too large") ::_exit(3);
    ::setrlimit(RLIMIT_FSIZE, &much);
    writer.end(Tick{9}, 1);
  });
  EXPECT_EQ(status, 0);
  Reader reader(file);
  int states = 0;
  while (reader.next_state() != nullptr) ++states;
  EXPECT_EQ(states, 10);
  EXPECT_TRUE(reader.ended());
}

TEST(RecordingSchedule, TakesTheFirstTickAtOrAfterEachMultiple) {
  const RecordingSchedule schedule(TickLength{262144}, 1);
  std::vector<std::int64_t> due;
  for (std::int64_t t = 0; t <= 130; ++t) {
    if (schedule.due(Tick{t})) due.push_back(t);
  }
  EXPECT_EQ(due, (std::vector<std::int64_t>{0, 31, 62, 92, 123}));
  EXPECT_EQ(schedule.at_or_after(Tick{63}), Tick{92});
  const RecordingSchedule each(TickLength{262144}, 0.032768);
  for (std::int64_t t = 0; t < 100'000; ++t) ASSERT_TRUE(each.due(Tick{t})) << t;
}

TEST(RecordingHeader, IsThatOfTheManifest) {
  proto::Manifest manifest;
  manifest.set_run(5);
  manifest.mutable_experiment()->set_name("box");
  manifest.mutable_experiment()->set_seed(9);
  manifest.mutable_experiment()->mutable_recording()->set_every_s(0.5);
  for (int i = 0; i < 3; ++i) manifest.add_x_mm(i);
  const proto::RecordingHeader header = recording_header(manifest, Tick{8}, 77);
  EXPECT_EQ(header.run(), 5u);
  EXPECT_EQ(header.name(), "box");
  EXPECT_EQ(header.seed(), 9u);
  EXPECT_EQ(header.tick_cycles(), 262144u);
  EXPECT_EQ(header.robots(), 3u);
  EXPECT_EQ(header.every_s(), 0.5);
  EXPECT_EQ(header.arena_width_mm(), 2000);
  EXPECT_EQ(header.first_tick(), 8);
  EXPECT_EQ(header.first_hash(), 77u);
  EXPECT_FALSE(header.messages());
}

}  // namespace
}  // namespace kilotwin::recorder

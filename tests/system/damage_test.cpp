// Files of a run directory that changed since they were written: every change is noticed, and named with its file.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "clients/recorder/reader.hpp"
#include "clients/recorder/run_directory.hpp"
#include "clients/recorder/writer.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;
using recorder::RunDirectory;

class Damage : public testing::Test {
 protected:
  static Words small(const Words& more) {
    Words words{source("experiments/disperse.txtpb"), "--robots", "12", "--mode", "local"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  [[nodiscard]] Outcome replay(const std::string& name) const {
    return kilotwin({"replay", scratch / name, "--verify"}, scratch);
  }
  /// Writes the recording of a run again, each record as `change` leaves it; records for which it says false are left out.
  void rewrite(const std::string& name, const std::function<bool(proto::Record&)>& change) const {
    const fs::path file = scratch.path() / name / "recording.ktrec", copy = scratch.path() / "copy.ktrec";
    fs::remove(copy);
    {
      recorder::Reader reader(file);
      recorder::Writer writer(copy, reader.header());
      while (const proto::Record* read = reader.next()) {
        proto::Record record = *read;
        if (!change(record)) continue;
        const auto octets = [](const std::string& text) {
          return std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());  // NOLINT
        };
        if (record.has_state()) {
          const proto::StateRecord& s = record.state();
          writer.state({Tick{s.tick()}, recorder::values(s.x_mm()), recorder::values(s.y_mm()),
                        recorder::values(s.heading_rad()), octets(s.led()), octets(s.life_cycle())});
        } else if (record.has_hash()) {
          Tick tick{record.hash().first_tick()};
          for (const std::uint64_t hash : record.hash().chain()) {
            writer.hash(tick, hash);
            ++tick;
          }
        } else if (record.has_radio()) {
          writer.radio(record.radio());
        } else if (record.has_end()) {
          writer.end(Tick{record.end().tick()}, record.end().state_hash(), record.end().failure());
        }
      }
      writer.flush();
      if (!reader.ended()) ADD_FAILURE() << reader.warning();
    }
    fs::rename(copy, file);
  }
  Scratch scratch;
};

/// Flips one to three bits of a file in each of `tries`; `use` must end in an error that names the file.
void flip_bits(const fs::path& file, int tries, std::mt19937_64& random, const std::function<Outcome()>& use) {
  const std::string right = read(file);
  for (int attempt = 0; attempt < tries; ++attempt) {
    std::string wrong = right;
    for (std::uint64_t bits = 1 + random() % 3; bits > 0; --bits) {
      const std::uint64_t bit = random() % (8 * wrong.size());
      wrong[bit / 8] = static_cast<char>(wrong[bit / 8] ^ 1 << bit % 8);
    }
    if (wrong == right) continue;
    write(file, wrong);
    const Outcome outcome = use();
    EXPECT_TRUE(outcome.status == 1 || outcome.status == 2) << file << ", try " << attempt << ": " << outcome.out;
    EXPECT_NE(outcome.err.find(file.filename().string()), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
  write(file, right);
}

TEST_F(Damage, FlippedBitsAreNoticedByReplayAndResume) {
  run(small({"--duration", "3", "--checkpoint-every", "2"}), scratch, "saved");
  run(small({"--duration", "4", "--resume", scratch / "saved"}), scratch, "resumed");
  ASSERT_EQ(replay("resumed").status, 0);
  std::mt19937_64 random(5);
  std::vector<fs::path> replayed{scratch / "resumed/manifest.pb", scratch / "resumed/recording.ktrec"};
  for (const char* folder : {"resumed/resumed", "resumed/programs"}) {
    for (const auto& entry : fs::directory_iterator(scratch / folder)) {
      if (entry.path().extension() != ".c") replayed.push_back(entry.path());
    }
  }
  ASSERT_GE(replayed.size(), 7u);
  for (const fs::path& file : replayed) flip_bits(file, 10, random, [&] { return replay("resumed"); });
  EXPECT_EQ(replay("resumed").status, 0);

  const fs::path checkpoint = fs::directory_iterator(scratch / "saved/checkpoints")->path();
  for (const auto& entry : fs::directory_iterator(checkpoint)) {
    flip_bits(entry.path(), 10, random, [&] {
      Words words = small({"--duration", "4", "--resume", scratch / "saved", "--out", scratch / "again"});
      words.insert(words.begin(), "run");
      return kilotwin(words, scratch);
    });
  }
  EXPECT_FALSE(fs::exists(scratch / "again"));
}

TEST_F(Damage, FilesOfOlderFormatsAreRefusedInOneLine) {
  run(small({"--duration", "1"}), scratch, "run");
  const auto directory = RunDirectory::open(scratch / "run", RunDirectory::Needs::kManifest);
  const std::string manifest = read(directory.manifest());
  write(directory.manifest(), directory.read_manifest().SerializeAsString());
  const Outcome outcome = replay("run");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(
      outcome.err.find("manifest.pb: is not the manifest of a run in format 2: another file, an older format"),
      std::string::npos)
      << outcome.err;
}

TEST_F(Damage, AManifestWithRightChecksumsAndWrongValuesEndsInOneLine) {
  run(small({"--duration", "1"}), scratch, "run");
  const auto directory = RunDirectory::open(scratch / "run", RunDirectory::Needs::kManifest);
  const proto::Manifest right = directory.read_manifest();
  const std::pair<const char*, std::function<void(proto::Manifest&)>> cases[] = {
      {"tick_cycles", [](proto::Manifest& m) { m.mutable_experiment()->set_tick_cycles(1); }},
      {"duration_s", [](proto::Manifest& m) { m.mutable_experiment()->set_duration_s(1e300); }},
      {"width_mm", [](proto::Manifest& m) { m.mutable_experiment()->mutable_arena()->set_width_mm(1e200); }},
      {"every_s", [](proto::Manifest& m) { m.mutable_experiment()->mutable_recording()->set_every_s(1e-300); }},
      {"hosts", [](proto::Manifest& m) { m.mutable_experiment()->mutable_deployment()->set_hosts(64); }},
      {"pose", [](proto::Manifest& m) { m.set_x_mm(3, 1e250); }},
      {"pose", [](proto::Manifest& m) { m.set_heading_rad(3, std::nan("")); }},
      {"pace", [](proto::Manifest& m) { m.set_pace(1e-300); }},
      {"pace", [](proto::Manifest& m) { m.set_pace(std::nan("")); }},
      {"count is 4000000000",
       [](proto::Manifest& m) { m.mutable_experiment()->mutable_robots(0)->set_count(4'000'000'000u); }},
  };
  for (const auto& [word, change] : cases) {
    proto::Manifest wrong = right;
    change(wrong);
    directory.write_manifest(wrong);
    Process process({program(), "replay", scratch / "run", "--verify"}, scratch.path());
    const Outcome outcome = process.wait(30);
    EXPECT_EQ(outcome.status, 2) << word << outcome.err;
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
  }
}

TEST_F(Damage, ManifestsMutatedAtRandomNeverHang) {
  run(small({"--duration", "1"}), scratch, "run");
  const auto directory = RunDirectory::open(scratch / "run", RunDirectory::Needs::kManifest);
  const std::string right = directory.read_manifest().SerializeAsString();
  std::mt19937_64 random(28);
  int read = 0;
  while (read < 40) {
    std::string bytes = right;
    for (std::uint64_t changes = 1 + random() % 3; changes > 0; --changes)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    proto::Manifest wrong;
    if (!wrong.ParseFromString(bytes)) continue;
    ++read;
    directory.write_manifest(wrong);
    Process process({program(), "replay", scratch / "run", "--verify"}, scratch.path());
    const Outcome outcome = process.wait(60);
    EXPECT_LE(outcome.status, 2) << outcome.err;
  }
}

TEST_F(Damage, ReplayComparesRecordedStates) {
  run(small({"--duration", "3"}), scratch, "run");
  const Outcome right = replay("run");
  ASSERT_EQ(right.status, 0) << right.err;
  EXPECT_NE(right.out.find("93 ticks, up to tick 92"), std::string::npos) << right.out;
  EXPECT_NE(right.out.find("4 recorded states agree"), std::string::npos) << right.out;
  const std::string original = read(scratch / "run/recording.ktrec");
  const auto expect_refused = [&](const char* word, const std::function<bool(proto::Record&)>& change) {
    rewrite("run", change);
    const Outcome wrong = replay("run");
    EXPECT_EQ(wrong.status, 1) << wrong.out;
    EXPECT_NE(wrong.err.find(word), std::string::npos) << wrong.err;
    write(scratch / "run/recording.ktrec", original);
  };
  const auto at = [](const proto::Record& record, std::int64_t tick) {
    return record.has_state() && record.state().tick() == tick;
  };
  expect_refused("tick 31: robot 3: y_mm is ", [&](proto::Record& record) {
    if (at(record, 31)) record.mutable_state()->set_y_mm(3, record.state().y_mm(3) + 1e-9);
    return true;
  });
  expect_refused("tick 62: robot 5: led is ", [&](proto::Record& record) {
    if (at(record, 62)) (*record.mutable_state()->mutable_led())[5] ^= 2;
    return true;
  });
  expect_refused("tick 31: the recording holds no state", [&](proto::Record& record) { return !at(record, 31); });
  rewrite("run", [](proto::Record&) { return true; });
  EXPECT_EQ(replay("run").status, 0);
}

TEST_F(Damage, ReplayRefusesARecordingThatIsShorterThanTheRun) {
  run(small({"--duration", "3"}), scratch, "run");
  const std::string original = read(scratch / "run/recording.ktrec");
  const auto first_half = [](proto::Record& record) {
    if (record.has_hash()) record.mutable_hash()->mutable_chain()->Truncate(40);
    return (record.has_state() && record.state().tick() < 40) || record.has_hash();
  };
  rewrite("run", first_half);
  const Outcome half = replay("run");
  EXPECT_EQ(half.status, 1) << half.out;
  EXPECT_NE(
      half.err.find("it ends at tick 39 without an end mark, but summary.json says that the run ended at tick 92"),
      std::string::npos)
      << half.err;
  // Without a summary the run was killed; what was recorded until then is verified.
  fs::rename(scratch / "run/summary.json", scratch / "summary.json");
  const Outcome killed = replay("run");
  EXPECT_EQ(killed.status, 0) << killed.err;
  EXPECT_NE(killed.out.find("40 ticks, up to tick 39"), std::string::npos) << killed.out;
  EXPECT_NE(killed.out.find("no end mark"), std::string::npos) << killed.out;
  write(scratch / "run/recording.ktrec", original);
  // An end mark that is kept does not hide what is missing before it.
  rewrite("run", [&](proto::Record& record) { return first_half(record) || record.has_end(); });
  const Outcome marked = replay("run");
  EXPECT_EQ(marked.status, 1) << marked.out;
  EXPECT_NE(marked.err.find("its end mark is of tick 92"), std::string::npos) << marked.err;
}

}  // namespace
}  // namespace kilotwin::test

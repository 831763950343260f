// Determinism: one state hash for every partition grid, number of hosts, number of threads and mode.
#include <gtest/gtest.h>

#include <fstream>
#include <memory>

#include "core/dds/dds.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

/// The state hash of disperse with 100 robots and 10 s. It changes only with a change of a model. It is the same for every
/// compiler, optimisation level and sanitizer.
constexpr std::uint64_t kGolden = 0xad091ef4a79041e3;

Words disperse(const Words& more) {
  Words words{source("experiments/disperse.txtpb"), "--duration", "10"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

struct Division {
  const char* name;
  Words words;
};
void PrintTo(const Division& division, std::ostream* out) { *out << division.name; }

class OneHash : public testing::TestWithParam<Division> {};

TEST_P(OneHash, HoweverARunIsDivided) {
  const Scratch scratch;
  EXPECT_EQ(run(disperse(GetParam().words), scratch, "run").state_hash, kGolden);
}

INSTANTIATE_TEST_SUITE_P(
    Hashes, OneHash,
    testing::Values(Division{"local_1x1", {"--mode", "local", "--partitions", "1x1"}},
                    Division{"local_2x2_threads", {"--mode", "local", "--partitions", "2x2", "--threads", "2"}},
                    Division{"local_3x2_hosts_threads",
                             {"--mode", "local", "--partitions", "3x2", "--hosts", "3", "--threads", "4"}},
                    Division{"local_40x1", {"--mode", "local", "--partitions", "40x1"}},
                    Division{"federated_1x1", {"--partitions", "1x1"}},
                    Division{"federated_2x1", {"--partitions", "2x1"}},
                    Division{"federated_2x2_hosts", {"--partitions", "2x2", "--hosts", "2"}},
                    Division{"federated_3x2_hosts", {"--partitions", "3x2", "--hosts", "3"}}),
    [](const testing::TestParamInfo<Division>& tested) { return tested.param.name; });

TEST(Hashes, DifferWithTheSeed) {
  const Scratch scratch;
  EXPECT_NE(run(disperse({"--mode", "local", "--seed", "2"}), scratch, "run").state_hash, kGolden);
}

TEST(Hashes, AreThoseOfServicesStartedByHand) {
  const Scratch scratch;
  const std::string directory = scratch / "run";
  Words words = disperse({"--partitions", "2x1", "--hosts", "2", "--prepare", "--out", directory});
  words.insert(words.begin(), "run");
  ASSERT_EQ(kilotwin(words, scratch).status, 0);
  const OwnDomain domain;
  const auto service = [&](Words more) {
    Words all{program(), "service"};
    all.insert(all.end(), more.begin(), more.end());
    all.insert(all.end(), {"--run", directory, "--domain", domain.name});
    return std::make_unique<Process>(all, scratch.path());
  };
  std::vector<std::unique_ptr<Process>> services;
  // In an order that differs from the launcher's.
  services.push_back(service({"behaviours", "--share", "2/2"}));
  services.push_back(service({"physics", "--partition", "1,0"}));
  services.push_back(service({"station"}));
  services.push_back(service({"comm"}));
  services.push_back(service({"physics", "--partition", "0,0"}));
  services.push_back(service({"behaviours", "--share", "1/2"}));
  for (const auto& process : services) {
    const Outcome outcome = process->wait();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
  }
  EXPECT_EQ(recorder::read_summary(directory + "/summary.json").state_hash, kGolden);
}

/// Nine robots push a box, and the box pushes a cylinder, across the borders of all grids below.
std::string moving_bodies(const Scratch& scratch, const std::string& mass_g) {
  const std::string file = scratch / ("bodies-" + mass_g + ".txtpb");
  std::ofstream(file) << "duration_s: 12 seed: 3 arena { width_mm: 900 height_mm: 700 } "
                         "robots { count: 9 behaviour: \""
                      << source("behaviours/straight.c")
                      << "\" layout { y_mm: -150 grid { pitch_mm: 36 columns: 9 from_first_row: true "
                         "heading: HEADING_FIXED heading_deg: 90 } } } "
                         "movable { box { width_mm: 330 length_mm: 60 } y_mm: -100 mass_g: "
                      << mass_g << " } movable { cylinder { radius_mm: 40 } mass_g: 6 y_mm: -20 x_mm: 10 }";
  return file;
}

TEST(Hashes, AreOneWithBodiesThatCrossBorders) {
  const Scratch scratch;
  const std::string experiment = moving_bodies(scratch, "18");
  int runs = 0;
  const auto hash = [&](const std::string& file, Words words) {
    words.insert(words.begin(), file);
    return run(words, scratch, "run-" + std::to_string(++runs)).state_hash;
  };
  const std::uint64_t whole = hash(experiment, {"--mode", "local", "--partitions", "1x1"});
  EXPECT_NE(whole, hash(moving_bodies(scratch, "500"), {"--mode", "local"})) << "the box does not move";
  for (const Words& words : {Words{"--mode", "local", "--partitions", "2x2", "--threads", "2"},
                             Words{"--mode", "local", "--partitions", "5x6", "--hosts", "3", "--threads", "4"},
                             Words{"--partitions", "1x2"}, Words{"--partitions", "2x3", "--hosts", "2"}}) {
    EXPECT_EQ(hash(experiment, words), whole) << words.back();
  }
}

// The ODE engine's results depend on the experiment and the partition grid, not on threads or processes. The crowd is dense, so
// that both of the engine's solvers work, on two threads at a time.
TEST(Hashes, OfTheOdeEngineAreTheSameInThreadsAndProcesses) {
  const Scratch scratch;
  const auto with = [&](const Words& more, const std::string& name) {
    Words words{source("experiments/disperse.txtpb"),
                "--duration",
                "4",
                "--partitions",
                "2x1",
                "--set",
                "physics.engine=ODE",
                "--set",
                "robots.layout.grid.pitch_mm=33"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words, scratch, name).state_hash;
  };
  const std::uint64_t local = with({"--mode", "local"}, "local");
  EXPECT_EQ(with({"--mode", "local", "--threads", "2", "--hosts", "2"}, "threads"), local);
  EXPECT_EQ(with({"--hosts", "2"}, "federated"), local);
}

class VirtualEnvironments : public testing::TestWithParam<const char*> {};

TEST_P(VirtualEnvironments, HaveOneHashHoweverARunIsDivided) {
  const Scratch scratch;
  const Words words{source(GetParam()), "--duration", "20"};
  const auto with = [&](const Words& more, const std::string& name) {
    Words all = words;
    all.insert(all.end(), more.begin(), more.end());
    return run(all, scratch, name);
  };
  const recorder::Summary local = with({"--mode", "local"}, "local");
  const recorder::Summary federated = with({"--partitions", "2x2", "--hosts", "2"}, "federated");
  EXPECT_EQ(local.state_hash, federated.state_hash);
  EXPECT_EQ(local.messages.received, federated.messages.received);
}

INSTANTIATE_TEST_SUITE_P(Hashes, VirtualEnvironments,
                         testing::Values("experiments/ark-hub.txtpb", "experiments/ark-foraging.txtpb"),
                         [](const auto& tested) {
                           return std::string(tested.param).find("hub") != std::string::npos ? "Hub" : "Foraging";
                         });

}  // namespace
}  // namespace kilotwin::test

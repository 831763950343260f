// Random changes of input files: each gives success or a UserError of one line, never a crash or another exception.
#include <random>

#include "scratch.hpp"

namespace kilotwin::test {
namespace {

const char* const kSeeds[] = {
    "name: 'a' duration_s: 60 seed: 3 tick_cycles: 262144\narena { width_mm: 2000 height_mm: 1500 }\n"
    "robots {\n  count: 100\n  behaviour: 'a.c'\n  layout { x_mm: 3 grid { pitch_mm: 40 columns: 12 heading: "
    "HEADING_FIXED "
    "heading_deg: 45 } }\n}\nradio { range_mm: 100 loss: 0.1 oscillator_sd: 0.01 }\n"
    "deployment { partition_columns: 2 partition_rows: 2 hosts: 3 checkpoint_every_s: 10 }\n",
    "robots { behaviour: [\"a.c\", \"a.c\"] layout { rings { count: [1, 8, 16] radius_mm: [0, 50, 100] } } }\n"
    "robots { count: 20 behaviour: 'a.c' layout { x_mm: 500 random { width_mm: 400 height_mm: 400 min_gap_mm: 3 } "
    "} }\n"
    "motion { noise: false bias_sd_mm_s: 1.5 calibrated_turn_duty: 70 }\nrobot_model { robot: 3 bias_left_mm_s: "
    "0.5 }\n"
    "physics { engine: PLANAR sub_steps: 2 }\nrecording { every_s: 0.5 messages: true }\n",
    ("robots { body: TRACKED layout { poses { csv: 'p.csv' } } }  # real ones\n"
     "station { start_broadcast_s: 0.5 environment { hub { x_mm: 10 radius_mm: 50 } } packet_interval_s: 0.1 }\n"),
};
const char* const kCsv = "x_mm,y_mm,heading_deg\n0,0,90\n100,-50.5,-180\n200,1e1,0\n";
const char* const kPieces[] = {"{",
                               "}",
                               "[",
                               "]",
                               ":",
                               "-",
                               "nan",
                               "inf",
                               "1e308",
                               "0",
                               "99999999999999999999",
                               "'",
                               "\"",
                               "#",
                               "\n",
                               "robots",
                               "count",
                               "layout",
                               "random",
                               "rings",
                               "poses",
                               "grid",
                               "heading",
                               "<",
                               ">",
                               ";",
                               ",",
                               "\\",
                               "\x01",
                               "\xff",
                               "0x7fffffff",
                               "4294967295",
                               "-0",
                               "1e-320",
                               "[ext.x]",
                               "/",
                               "1"};

using Engine = std::mt19937;

std::size_t below(Engine& engine, std::size_t n) { return engine() % n; }

std::string mutated(std::string text, Engine& engine) {
  for (std::size_t edits = 1 + below(engine, 4); edits-- > 0;) {
    const std::size_t at = below(engine, text.size() + 1), length = below(engine, 12);
    switch (below(engine, 6)) {
      case 0: text.erase(at, length); break;
      case 1: text.insert(at, kPieces[below(engine, std::size(kPieces))]); break;
      case 2:
        text.replace(at, std::min(length, text.size() - at), kPieces[below(engine, std::size(kPieces))]);
        break;
      case 3:
        if (at < text.size()) text[at] = static_cast<char>(engine());
        break;
      case 4: text.insert(below(engine, text.size() + 1), text.substr(at, 10 * length)); break;
      case 5:
        if (at < text.size() && text[at] >= '0' && text[at] <= '9')
          text[at] = static_cast<char>('0' + below(engine, 10));
        break;
    }
  }
  return text;
}

class Mutations : public Scratch {
 protected:
  /// Returns the number of attempts that succeed. Checks that errors are one line of limited length.
  template <class Attempt> static int successes(int attempts, unsigned seed, Attempt attempt) {
    int good = 0;
    Engine engine{seed};
    for (int i = 0; i < attempts; ++i) {
      try {
        attempt(engine);
        ++good;
      } catch (const UserError& error) {
        const std::string line = error.what();
        EXPECT_EQ(line.find_first_of("\n\r"), std::string::npos) << line;
        EXPECT_LT(line.size(), 1000u) << line;
        EXPECT_NE(line.find("; "), std::string::npos) << line;
      }
    }
    return good;
  }
};

TEST_F(Mutations, OfExperimentFiles) {
  write("p.csv", kCsv);
  const int good = successes(
      6000, 1, [&](Engine& engine) { validate(load(mutated(kSeeds[below(engine, std::size(kSeeds))], engine))); });
  EXPECT_GT(good, 300);
  EXPECT_LT(good, 5000);
}

TEST_F(Mutations, OfPosesFiles) {
  const LoadedExperiment loaded = load(kSeeds[2]);
  const int good = successes(3000, 2, [&](Engine& engine) {
    write("p.csv", mutated(kCsv, engine));
    validate(loaded);
  });
  EXPECT_GT(good, 100);
  EXPECT_LT(good, 2500);
}

TEST_F(Mutations, OfModelFiles) {
  const LoadedExperiment loaded = load(kSeeds[1]);
  const int good = successes(2000, 3, [&](Engine& engine) {
    LoadedExperiment copy = loaded;
    apply_model(
        copy,
        write("m.txtpb", mutated("motion { noise: true wheel_base_mm: 24 }\nrobot { robot: 2 bias_left_mm_s: 1 }\n"
                                 "robot { robot: 3 bias_right_mm_s: -1 }\n",
                                 engine)));
    validate(copy);
  });
  EXPECT_GT(good, 50);
  EXPECT_LT(good, 1800);
}

TEST_F(Mutations, OfOverrides) {
  write("p.csv", kCsv);
  const LoadedExperiment loaded[] = {load(kSeeds[0]), load(kSeeds[1]), load(kSeeds[2])};
  const char* const arguments[] = {"robots[0].layout.grid.pitch_mm=50",
                                   "seed=7",
                                   "robots.behaviour=a.c",
                                   "motion.noise=false",
                                   "robots[1].count=5",
                                   "robots.layout.rings.count[0]=3",
                                   "station.environment.hub.x_mm=3",
                                   "robots.body=TRACKED",
                                   "robots.layout.grid.heading=HEADING_INWARDS",
                                   "name=x"};
  const int good = successes(6000, 4, [&](Engine& engine) {
    LoadedExperiment copy = loaded[below(engine, std::size(loaded))];
    apply_override(copy, mutated(arguments[below(engine, std::size(arguments))], engine));
    validate(copy);
  });
  EXPECT_GT(good, 100);
  EXPECT_LT(good, 5000);
}

}  // namespace
}  // namespace kilotwin::test

#include "clients/identify/causes/hypotheses.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// What is natural to a target: an effect of that size would be seen by the naked eye.
double natural(Target target) {
  switch (target) {
    case Target::kGain:
    case Target::kGainLeft:
    case Target::kGainRight: return 1;
    case Target::kTurn: return 0.4;
    case Target::kOffset:
    case Target::kAhead:
    case Target::kSideways:
    case Target::kWorldX:
    case Target::kWorldY: return 10;
    case Target::kMeasuredX:
    case Target::kMeasuredY: return 30;
    case Target::kMeasuredAhead:
    case Target::kMeasuredLeft: return 10;
    case Target::kMeasuredScale:
    case Target::kMeasuredTurn: return 0.1;
    case Target::kMeasuredHeading: return 0.3;
  }
  return 1;
}

Factor over(Shape shape, Covariate of, double low, double high, std::uint32_t count) {
  Factor f;
  f.shape = shape;
  f.axis.of = of;
  f.low = low;
  f.high = high;
  f.count = count;
  return f;
}
Factor keyed(Shape shape, Covariate of, std::vector<double> points) {
  Factor f;
  f.shape = shape;
  f.axis.of = of;
  f.points = std::move(points);
  return f;
}

class Maker {
 public:
  explicit Maker(Dictionary& dictionary) : dictionary_(dictionary) {}

  /// Puts columns into the dictionary; returns the place of the first.
  Eigen::Index put(Target target, Basis basis, std::uint8_t during = kDriven) {
    const Eigen::Index first = columns_;
    const std::vector<double> rough = basis.roughness();
    for (const double r : rough) scales_.push_back(natural(target) * std::pow(r, -1.5));
    columns_ += static_cast<Eigen::Index>(rough.size());
    dictionary_.blocks.push_back({target, std::move(basis), is_measured(target) ? kAlways : during});
    return first;
  }
  std::uint32_t family(const std::string& name) {
    auto& families = dictionary_.families;
    const auto known = std::find(families.begin(), families.end(), name);
    if (known != families.end()) return static_cast<std::uint32_t>(known - families.begin());
    families.push_back(name);
    return static_cast<std::uint32_t>(families.size() - 1);
  }
  void add(const std::string& name, std::vector<std::string> covariates, const std::string& acts_on,
           std::vector<Eigen::Index> columns, double choices = 1) {
    std::sort(columns.begin(), columns.end());
    dictionary_.hypotheses.push_back(
        {name, std::move(covariates), acts_on, std::move(columns), family(name), std::log(choices)});
  }
  [[nodiscard]] Eigen::Index columns() const { return columns_; }
  void finish() {
    dictionary_.scale = Eigen::Map<Eigen::VectorXd>(scales_.data(), static_cast<Eigen::Index>(scales_.size()));
  }

 private:
  Dictionary& dictionary_;
  Eigen::Index columns_ = 0;
  std::vector<double> scales_;
};

/// Columns first .. first + count - 1 of each of several bases.
std::vector<Eigen::Index> some(const std::vector<Eigen::Index>& bases, Eigen::Index first, Eigen::Index count) {
  std::vector<Eigen::Index> columns;
  for (const Eigen::Index base : bases)
    for (Eigen::Index i = 0; i < count; ++i) columns.push_back(base + first + i);
  return columns;
}

struct Acting {
  const char* name;
  const char* in_words;
  std::vector<Target> targets;
  std::vector<std::string> words;  ///< covariates that the target itself brings
};

const Acting kSpeed{"speed", "speed of the wheels", {Target::kGain}, {}};
const Acting kTurning{"turning", "turn rate", {Target::kTurn}, {}};
const Acting kSlip{"slip", "sideways slip", {Target::kSideways}, {}};
const Acting kWorld{"drift", "drift in the room", {Target::kWorldX, Target::kWorldY}, {"world_frame"}};
const Acting kCamera{"camera", "measured position", {Target::kMeasuredX, Target::kMeasuredY}, {"measurement"}};
/// Turn and scale of the picture, each as of one camera.
const Acting kPicture{
    "camera", "measured position", {Target::kMeasuredTurn, Target::kMeasuredScale}, {"measurement"}};
const Acting kCompass{"compass", "measured heading", {Target::kMeasuredHeading}, {"measurement"}};

class Catalogue {
 public:
  Catalogue(const Extent& extent, Dictionary& dictionary) : extent_(extent), make_(dictionary) {}

  void fill() {
    of_time();
    of_use();
    of_place();
    of_heading();
    of_commands();
    of_neighbours();
    of_history();
    of_floor();
    of_lately();
    of_robots();
    of_runs();
  }
  /// What is found already and is larger for some than for others: an amount for each robot, and for each command.
  void of_found(const std::vector<Term>& terms) {
    for (const Term& term : terms) {
      const Block& block = term.blocks.front();
      const Acting* acting = nullptr;
      for (const Acting* one : {&kSpeed, &kTurning, &kSlip, &kWorld})
        if (one->targets.front() == block.target) acting = one;
      if (acting == nullptr || block.basis.factors.size() > 1) continue;
      std::string of;
      std::vector<std::string> words;
      Basis known;
      if (!block.basis.factors.empty()) {
        Factor factor = block.basis.factors.front();
        if (factor.shape == Shape::kTable || !factor.known.empty()) continue;
        of = "-and-" + of_words(factor.axis.of).first;
        words.push_back(of_words(factor.axis.of).second);
        factor.known.assign(factor.columns(), 0);
        for (std::size_t i = 0; i < block.basis.size(); ++i)
          factor.known[block.basis.chosen.empty() ? i : block.basis.chosen[i]] =
              term.coefficients[static_cast<Eigen::Index>(i)];
        known.factors.push_back(std::move(factor));
      }
      const auto amounts = [&](Covariate covariate, const std::vector<double>& keys) {
        Basis basis = known;
        basis.factors.insert(basis.factors.begin(), keyed(Shape::kTable, covariate, keys));
        // Of a drift the amounts along x and along y are of one shape only where it has but one.
        if (acting == &kWorld && !of.empty()) return;
        std::vector<std::string> all = words;
        all.push_back(of_words(covariate).second);
        add(*acting, of_words(covariate).first + of, all,
            some(put(*acting, basis, block.during), 0, static_cast<Eigen::Index>(keys.size())));
      };
      if (extent_.has_straight && extent_.has_turns) amounts(Covariate::kCommand, {1, 2, 3});
      if (acting != &kWorld && extent_.robots.size() > 1 && extent_.robots.size() <= 40)
        amounts(Covariate::kRobot, {extent_.robots.begin(), extent_.robots.end()});
      of_known_and_more(*acting, known, block.during);
    }
  }
  void finish() { make_.finish(); }

 private:
  /// What is known by one covariate may grow or shrink with time, be larger in some places, or as the robot points. What is known
  /// comes first, so that it is written once.
  void of_known_and_more(const Acting& acting, const Basis& known, std::uint8_t during) {
    if (&acting == &kWorld || known.factors.empty()) return;
    const auto is = of_words(known.factors.front().axis.of);
    const auto beside = [&](const char* word, Factor factor, std::initializer_list<Eigen::Index> sizes) {
      if (is.second == word) return;
      Basis basis = known;
      basis.factors.push_back(std::move(factor));
      const auto bases = put(acting, basis, during);
      std::string first = is.first;
      std::vector<std::string> words{is.second, word};
      if (words == std::vector<std::string>{"position", "time"}) {
        std::swap(words[0], words[1]);
        first = words[0];
      }
      for (const Eigen::Index size : sizes) add(acting, first + "-and-" + words[1], words, some(bases, 0, size));
    };
    beside("time", over(Shape::kCosines, Covariate::kTime, 0, extent_.duration_s, 6), {1, 2, 6});
    beside("position", plane(3), {1, 2, 9});
    beside("heading", over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 2), {2, 4});
  }
  /// As names of effects have a covariate, and as result.json has it.
  static std::pair<std::string, std::string> of_words(Covariate covariate) {
    switch (covariate) {
      case Covariate::kTime: return {"time", "time"};
      case Covariate::kX:
      case Covariate::kY:
      case Covariate::kRadius: return {"position", "position"};
      case Covariate::kHeading: return {"heading", "heading"};
      case Covariate::kCommand: return {"command", "command"};
      case Covariate::kSinceCommand: return {"time-since-command", "time_since_command"};
      case Covariate::kMotorTime:
      case Covariate::kLeftMotorTime:
      case Covariate::kRightMotorTime:
      case Covariate::kDrivenTime: return {"motor-time", "motor_time"};
      case Covariate::kNeighbours:
      case Covariate::kNearest:
      case Covariate::kDensity:
      case Covariate::kBearing: return {"neighbours", "neighbours"};
      case Covariate::kRobot: return {"robot", "robot"};
      default: return {"history", "history"};
    }
  }
  std::vector<Eigen::Index> put(const Acting& acting, const Basis& basis, std::uint8_t during = kDriven) {
    std::vector<Eigen::Index> bases;
    for (const Target target : acting.targets) bases.push_back(make_.put(target, basis, during));
    return bases;
  }
  void add(const Acting& acting, const std::string& of, std::vector<std::string> words,
           std::vector<Eigen::Index> columns, double choices = 1) {
    words.insert(words.begin(), acting.words.begin(), acting.words.end());
    make_.add(fmt_name(acting.name, of), std::move(words), acting.in_words, std::move(columns), choices);
  }
  static std::string fmt_name(const std::string& acting, const std::string& of) { return acting + "-by-" + of; }

  /// The smooth curve with ever more columns, and waves of one kind.
  std::vector<Eigen::Index> curve(const Acting& acting, const std::string& of,
                                  const std::vector<std::string>& words, const Basis& basis,
                                  std::vector<Eigen::Index> sizes, bool windows) {
    const auto bases = put(acting, basis);
    const auto n = static_cast<Eigen::Index>(basis.size());
    for (const Eigen::Index size : sizes)
      if (size <= n) add(acting, of, words, some(bases, 0, size));
    for (Eigen::Index first = 4; windows && first + 4 <= n; first += 2)
      add(acting, of, words, some(bases, first, 4), static_cast<double>(n) / 2);
    return bases;
  }

  void of_time() {
    const auto smooth = [&](std::uint32_t count) {
      return Basis{{over(Shape::kCosines, Covariate::kTime, 0, extent_.duration_s, count)}};
    };
    curve(kSpeed, "time", {"time"}, smooth(32), {1, 3, 8, 16, 32}, true);
    curve(kTurning, "time", {"time"}, smooth(12), {1, 3, 12}, true);
    drift_in_time_ = curve(kWorld, "time", {"time"}, smooth(32), {1, 3, 8, 16, 32}, true);
    // The picture may creep aside, turn and grow, each by itself or all at once.
    const auto aside = put(kCamera, smooth(16));
    const auto turned = put(kPicture, smooth(8));
    for (const Eigen::Index n : {1, 3, 8, 16}) add(kCamera, "time", {"time"}, some(aside, 0, n));
    for (const Eigen::Index n : {1, 3, 8}) {
      auto all = some(turned, 0, n);
      for (const Eigen::Index base : turned) add(kCamera, "time", {"time"}, some({base}, 0, n));
      for (const Eigen::Index c : some(aside, 0, n)) all.push_back(c);
      add(kCamera, "time", {"time"}, all);
    }
    if (extent_.headings) curve(kCompass, "time", {"time"}, smooth(6), {1, 3, 6}, false);
    // Steps, and pulses between two of them.
    constexpr int kSteps = 40;
    std::vector<double> at;
    for (int i = 1; i < kSteps; ++i) at.push_back(extent_.duration_s * i / kSteps);
    const Basis steps{{keyed(Shape::kAtLeast, Covariate::kTime, at)}};
    const auto n = static_cast<Eigen::Index>(at.size());
    for (const Acting* acting : {&kSpeed, &kWorld}) {
      const auto bases = put(*acting, steps);
      for (Eigen::Index i = 0; i < n; ++i) add(*acting, "time", {"time"}, some(bases, i, 1), kSteps);
      for (Eigen::Index width : {1, 2, 4, 8, 16}) {
        for (Eigen::Index i = 0; i + width < n; ++i) {
          auto columns = some(bases, i, 1);
          for (const Eigen::Index c : some(bases, i + width, 1)) columns.push_back(c);
          add(*acting, "time", {"time"}, columns, kSteps * 5.0);
        }
      }
      add(*acting, "time", {"time"}, some(bases, 0, n));
    }
  }
  void of_use() {
    const Basis motor{{over(Shape::kCosines, Covariate::kMotorTime, 0, extent_.motor_s, 8)}};
    curve(kSpeed, "motor-time", {"motor_time"}, motor, {1, 3, 8}, false);
    const Basis driven{{over(Shape::kCosines, Covariate::kDrivenTime, 0, extent_.driven_s, 6)}};
    curve(kTurning, "driven-time", {"motor_time"}, driven, {1, 3, 6}, false);
  }
  Factor plane(std::uint32_t order) const {
    Factor f = over(Shape::kCosines2, Covariate::kX, extent_.x_low_mm, extent_.x_high_mm, order);
    f.and_axis.of = Covariate::kY;
    f.and_low = extent_.y_low_mm;
    f.and_high = extent_.y_high_mm;
    return f;
  }
  void of_place() {
    const auto map = [&](const Acting& acting, std::uint32_t order) {
      const auto bases = put(acting, Basis{{plane(order)}});
      for (std::uint32_t o = 1; o <= order; ++o)
        add(acting, "position", {"position"}, some(bases, 0, (o + 1) * (o + 2) / 2 - 1));
      return bases;
    };
    map(kSpeed, 8);
    map(kTurning, 3);
    drift_in_place_ = map(kWorld, 5);
    map(kCamera, 5);
    // Lenses and tilts bend the picture most at its rim, where waves are flat. What they bend may be wider than what is seen.
    Factor bent = plane(5);
    bent.shape = Shape::kPolynomials2;
    const double beyond_x = 0.15 * (bent.high - bent.low), beyond_y = 0.15 * (bent.and_high - bent.and_low);
    bent.low -= beyond_x;
    bent.high += beyond_x;
    bent.and_low -= beyond_y;
    bent.and_high += beyond_y;
    const auto lens = put(kCamera, Basis{{bent}});
    for (Eigen::Index o = 1; o <= 5; ++o)
      add(kCamera, "position", {"position"}, some(lens, 0, (o + 1) * (o + 2) / 2 - 1));
    if (extent_.headings) map(kCompass, 2);
    // Stripes are finer than what a map of the plane resolves: pictures put together, boards of a floor.
    const auto stripes = [&](const Acting& acting, Covariate of, double low, double high, std::uint32_t count) {
      const auto bases = put(acting, Basis{{over(Shape::kCosines, of, low, high, count)}});
      for (Eigen::Index size = count / 2; size <= count; size += count / 2)
        add(acting, "position", {"position"}, some(bases, 0, size));
    };
    for (const auto& [acting, count] : {std::pair{&kCamera, 24u}, {&kSpeed, 16u}}) {
      stripes(*acting, Covariate::kX, extent_.x_low_mm, extent_.x_high_mm, count);
      stripes(*acting, Covariate::kY, extent_.y_low_mm, extent_.y_high_mm, count);
    }
  }
  void of_heading() {
    const Basis round{{over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 4)}};
    curve(kSpeed, "heading", {"heading"}, round, {2, 4, 8}, false);
    curve(kTurning, "heading", {"heading"}, round, {2, 4, 8}, false);
    curve(kSlip, "heading", {"heading"}, round, {2, 4}, false);
    if (extent_.headings) curve(kCompass, "heading", {"heading"}, round, {2, 4}, false);
    const auto constant = put(kWorld, Basis{});
    make_.add("drift", {"world_frame"}, kWorld.in_words, some(constant, 0, 1));
    // A drift that changes has a mean as well.
    const auto and_constant = [&](std::vector<Eigen::Index> columns) {
      for (const Eigen::Index c : constant) columns.push_back(c);
      return columns;
    };
    for (const Eigen::Index size : {1, 3, 8})
      add(kWorld, "time", {"time"}, and_constant(some(drift_in_time_, 0, size)));
    for (const Eigen::Index order : {1, 2, 3})
      add(kWorld, "position", {"position"},
          and_constant(some(drift_in_place_, 0, (order + 1) * (order + 2) / 2 - 1)));
    if (extent_.has_stop) {
      const auto at_rest = put(kWorld, Basis{}, 1);
      make_.add("drift-at-rest", {"world_frame"}, kWorld.in_words, some(at_rest, 0, 1));
      auto both = some(constant, 0, 1);
      for (const auto c : some(at_rest, 0, 1)) both.push_back(c);
      make_.add("drift", {"world_frame"}, kWorld.in_words, both);
    }
  }
  void of_commands() {
    std::vector<double> moving;
    if (extent_.has_straight) moving.push_back(1);
    if (extent_.has_turns) moving.insert(moving.end(), {2, 3});
    const Basis which{{keyed(Shape::kTable, Covariate::kCommand, moving)}};
    const auto n = static_cast<Eigen::Index>(moving.size());
    for (const Acting* acting : {&kSpeed, &kTurning, &kSlip}) {
      const auto bases = put(*acting, which);
      for (Eigen::Index i = 0; i < n; ++i)
        add(*acting, "command", {"command"}, some(bases, i, 1), static_cast<double>(n));
      add(*acting, "command", {"command"}, some(bases, 0, n));
    }
    for (const Target wheel : {Target::kGainLeft, Target::kGainRight}) {
      const auto base = make_.put(wheel, which);
      for (Eigen::Index i = 0; i < n; ++i)
        make_.add("speed-by-command", {"command"}, kSpeed.in_words, {base + i}, static_cast<double>(n) * 2);
    }
    // Robots that are told to stop may creep on.
    if (extent_.has_stop) {
      constexpr std::uint8_t kAtRest = 1;
      const auto ahead = make_.put(Target::kAhead, {}, kAtRest), aside = make_.put(Target::kSideways, {}, kAtRest),
                 turning = make_.put(Target::kTurn, {}, kAtRest);
      make_.add("creep-by-command", {"command"}, "motion at rest", {ahead}, 2);
      make_.add("creep-by-command", {"command"}, "motion at rest", {ahead, aside, turning}, 2);
    }
    // A tracker that lags sees moving robots where they were.
    if (moving.size() > 1) {
      const auto ahead = make_.put(Target::kMeasuredAhead, which);
      make_.add("camera-by-command", {"measurement", "command"}, kCamera.in_words, some({ahead}, 0, n));
    }
    Factor since = over(Shape::kCosines, Covariate::kSinceCommand, 0, extent_.since_s, 8);
    since.warp = 1;
    const Basis start{{since}};
    curve(kSpeed, "time-since-command", {"time_since_command"}, start, {1, 3, 8}, false);
    curve(kTurning, "time-since-command", {"time_since_command"}, start, {1, 3, 8}, false);
    curve(kSlip, "time-since-command", {"time_since_command"}, start, {3}, false);
    if (n == 1) return;
    since.count = 3;
    const Basis each{{keyed(Shape::kTable, Covariate::kCommand, moving), since}};
    for (const Acting* acting : {&kSpeed, &kTurning})
      add(*acting, "command-and-time-since-command", {"command", "time_since_command"},
          some(put(*acting, each), 0, 3 * n));
  }
  void of_neighbours() {
    if (!extent_.neighbours) return;
    // 70, 100 and 150 mm; which it is exactly is found when the effect gets its shape.
    constexpr std::uint8_t kSought[] = {3, 6, 11};
    const auto with_radius = [](Factor f, std::uint8_t radius) {
      f.axis.radius = radius;
      return f;
    };
    for (const std::uint8_t r : kSought) {
      const double reach = kNeighbourRadii_mm[r];
      const Factor near = with_radius(over(Shape::kTaper, Covariate::kNearest, 0, reach, 3), r);
      const auto bases = put(kSpeed, Basis{{near}});
      for (const Eigen::Index n : {1, 3}) add(kSpeed, "neighbours", {"neighbours"}, some(bases, 0, n), 6);
      const Factor falling = with_radius(over(Shape::kTaper, Covariate::kNearest, 0, reach, 2), r);
      const Factor bearing = with_radius(over(Shape::kHarmonics, Covariate::kBearing, 0, 1, 1), r);
      for (const Acting* acting : {&kTurning, &kSlip}) {
        const auto aside = put(*acting, Basis{{falling, bearing}});
        add(*acting, "neighbours", {"neighbours"}, {aside[0] + 1}, 6);
        add(*acting, "neighbours", {"neighbours"}, {aside[0] + 1, aside[0] + 3}, 6);
      }
      const auto forward = make_.put(Target::kAhead, Basis{{falling, bearing}});
      make_.add("speed-by-neighbours", {"neighbours"}, kSpeed.in_words, {forward, forward + 2}, 6);
    }
    // Wherever the nearest is.
    const Factor close = with_radius(over(Shape::kTaper, Covariate::kNearest, 0, kNeighbourRadii_mm[6], 2), 6);
    const auto spun = put(kTurning, Basis{{close}});
    add(kTurning, "neighbours", {"neighbours"}, some(spun, 0, 2), 6);
    for (const std::uint8_t r : kSought) {
      const Factor count = with_radius(over(Shape::kCosines, Covariate::kNeighbours, 0, 8, 3), r);
      const auto bases = put(kSpeed, Basis{{count}});
      for (const Eigen::Index n : {1, 3}) add(kSpeed, "neighbours", {"neighbours"}, some(bases, 0, n), 8);
      const Factor density = with_radius(over(Shape::kCosines, Covariate::kDensity, 0, 4, 3), r);
      const auto dense = put(kSpeed, Basis{{density}});
      for (const Eigen::Index n : {1, 3}) add(kSpeed, "neighbours", {"neighbours"}, some(dense, 0, n), 8);
    }
  }
  /// What came before: in constant amounts or in curves since the command, whatever it does now, and going straight.
  void of_history() {
    if (!extent_.has_turns && !extent_.has_stop) return;
    constexpr std::uint8_t kStraightOnly = 1u << 1;
    constexpr Eigen::Index kCurve = 4;
    std::vector<double> before{kNoCommand};
    if (extent_.has_turns) before.insert(before.begin(), {2, 3});
    const auto turns = static_cast<Eigen::Index>(before.size()) - 1;
    if (extent_.has_stop) before.push_back(0);
    const auto keys = static_cast<Eigen::Index>(before.size());
    Factor since = over(Shape::kCosines, Covariate::kSinceCommand, 0, extent_.since_s, kCurve);
    since.first = 0;
    since.warp = 1;
    const Factor which = keyed(Shape::kTable, Covariate::kPreviousCommand, before);
    for (const Acting* acting : {&kTurning, &kSpeed, &kSlip}) {
      // Slip in constant amounts alone.
      const Eigen::Index curve = acting == &kSlip ? 1 : kCurve;
      const Basis basis = curve > 1 ? Basis{{which, since}} : Basis{{which}};
      const auto driven = put(*acting, basis), straight = put(*acting, basis, kStraightOnly);
      const auto after = [&](std::vector<Eigen::Index> bases, Eigen::Index from, Eigen::Index to) {
        for (const Eigen::Index size :
             curve > 1 ? std::vector<Eigen::Index>{1, curve} : std::vector<Eigen::Index>{1}) {
          std::vector<Eigen::Index> columns;
          for (Eigen::Index key = from; key < to; ++key)
            for (const Eigen::Index c : some(bases, key * curve, size)) columns.push_back(c);
          std::vector<std::string> words{"history"};
          if (size > 1) words.emplace_back("time_since_command");
          add(*acting, "previous-command", words, columns, 4);
        }
      };
      for (const auto& bases : {driven, straight, std::vector<Eigen::Index>{driven[0], straight[0]}}) {
        if (turns > 0) after(bases, 0, turns);
        if (extent_.has_stop) {
          after(bases, keys - 1, keys);
          after(bases, turns, keys);
        }
        after(bases, 0, keys);
      }
    }
    of_lasting(kStraightOnly);
    if (!extent_.has_turns) return;
    const Factor last = keyed(Shape::kTable, Covariate::kLastTurn, {2, 3});
    for (const Acting* acting : {&kTurning, &kSpeed, &kSlip}) {
      const auto turned = put(*acting, Basis{{last}}, kStraightOnly);
      add(*acting, "last-turn", {"history"}, some(turned, 0, 2));
    }
  }
  /// How long it did what came before: whatever it does now, or going straight. Turns that lasted go on turning.
  void of_lasting(std::uint8_t straight_only) {
    constexpr Eigen::Index kCurve = 3;
    Factor lasted = over(Shape::kCosines, Covariate::kPreviousLasted, 0, extent_.since_s, kCurve);
    lasted.warp = 1;
    for (const std::uint8_t during : {kDriven, straight_only}) {
      const auto bases = put(kSpeed, Basis{{lasted}}, during);
      for (const Eigen::Index size : {Eigen::Index{1}, kCurve})
        add(kSpeed, "previous-lasted", {"history"}, some(bases, 0, size), 4);
    }
    if (!extent_.has_turns) return;
    const Factor which = keyed(Shape::kTable, Covariate::kPreviousCommand, {2, 3});
    lasted.count = 2;
    const auto turned = put(kTurning, Basis{{which, lasted}}, straight_only);
    add(kTurning, "previous-lasted", {"history"}, some(turned, 0, 4), 2);
  }
  void of_floor() {
    for (std::uint8_t cells = 0; cells < kFloorCells; ++cells) {
      Factor f = keyed(Shape::kExponential, Covariate::kTrodden, {2, 8, 32});
      f.axis.radius = cells;
      const auto bases = put(kSpeed, Basis{{f}});
      add(kSpeed, "trodden", {"history", "position"}, some(bases, 0, 3), kFloorCells);
    }
  }
  /// What motors did lately, which fades: they warm up and cool down, recover, turned more to one side than to the other.
  void of_lately() {
    const auto lately = [&](Shape shape, Covariate of, std::size_t forget, std::uint32_t count) {
      Factor f = over(shape, of, 0, std::min(kForget_s[forget], extent_.driven_s), count);
      f.axis.forget = static_cast<std::uint8_t>(forget + 1);
      return f;
    };
    constexpr auto kChoices = static_cast<double>(kForget_s.size());
    for (std::size_t f = 0; f < kForget_s.size(); ++f) {
      for (const Covariate of : {Covariate::kMotorTime, Covariate::kDrivenTime}) {
        const auto bases = put(kSpeed, Basis{{lately(Shape::kCosines, of, f, 3)}});
        for (const Eigen::Index size : {1, 3})
          add(kSpeed, of == Covariate::kMotorTime ? "motor-time-of-late" : "driven-time-of-late",
              {"motor_time", "history"}, some(bases, 0, size), kChoices);
      }
      if (!extent_.has_turns) continue;
      const auto left = make_.put(Target::kTurn, Basis{{lately(Shape::kLinear, Covariate::kLeftMotorTime, f, 1)}}),
                 right =
                     make_.put(Target::kTurn, Basis{{lately(Shape::kLinear, Covariate::kRightMotorTime, f, 1)}});
      add(kTurning, "turns-of-late", {"history"}, {left, right}, kChoices);
    }
    if (!extent_.has_turns) return;
    // All that it has turned, as a cable winds up.
    const auto left = make_.put(Target::kTurn,
                                Basis{{over(Shape::kLinear, Covariate::kLeftMotorTime, 0, extent_.motor_s, 1)}}),
               right = make_.put(Target::kTurn,
                                 Basis{{over(Shape::kLinear, Covariate::kRightMotorTime, 0, extent_.motor_s, 1)}});
    add(kTurning, "turns-so-far", {"history", "motor_time"}, {left, right}, kChoices);
  }
  void of_robots() {
    constexpr std::size_t kMost = 120;
    if (extent_.robots.size() < 2 || extent_.robots.size() > kMost) return;
    std::vector<double> keys(extent_.robots.begin(), extent_.robots.end());
    const auto n = static_cast<Eigen::Index>(keys.size());
    const auto gains = put(kSpeed, Basis{{keyed(Shape::kTable, Covariate::kRobot, keys)}});
    add(kSpeed, "robot", {"robot"}, some(gains, 0, n));
    if (keys.size() > 40) return;
    const auto slopes = put(kSpeed, Basis{{keyed(Shape::kTable, Covariate::kRobot, keys),
                                           over(Shape::kLinear, Covariate::kTime, 0, extent_.duration_s, 1)}});
    add(kSpeed, "robot-and-time", {"robot", "time"}, some(slopes, 0, n));
    // A leg that is bent, a marker that was put on askew.
    const Basis each{{keyed(Shape::kTable, Covariate::kRobot, keys)}};
    add(kSlip, "robot", {"robot"}, some(put(kSlip, each), 0, n));
    if (extent_.headings) add(kCompass, "robot", {"robot"}, some(put(kCompass, each), 0, n));
    const auto ahead = make_.put(Target::kMeasuredAhead, each, kAlways),
               left = make_.put(Target::kMeasuredLeft, each, kAlways);
    make_.add("camera-by-robot", {"measurement", "robot"}, kCamera.in_words, some({ahead, left}, 0, n));
  }

  /// What is set up anew for each run. A shift or turn of all that is measured shows nowhere.
  void of_runs() {
    constexpr std::size_t kMost = 40;
    if (extent_.runs.size() < 2 || extent_.runs.size() > kMost) return;
    const Basis which{{keyed(Shape::kTable, Covariate::kRun, {extent_.runs.begin(), extent_.runs.end()})}};
    const auto n = static_cast<Eigen::Index>(extent_.runs.size());
    const auto scale = make_.put(Target::kMeasuredScale, which);
    make_.add("camera-by-run", {"measurement"}, kCamera.in_words, some({scale}, 0, n));
    // Robots may as well have been slower: turns tell the one from the other.
    add(kSpeed, "run", {"history"}, some(put(kSpeed, which), 0, n));
    if (extent_.headings) add(kCompass, "run", {}, some(put(kCompass, which), 0, n));
  }

  const Extent& extent_;
  Maker make_;
  std::vector<Eigen::Index> drift_in_time_, drift_in_place_;  ///< first columns, along x and along y
};

}  // namespace

Extent extent_of(const PreparedSet& set) {
  Extent e;
  std::vector<double> xs, ys;
  e.duration_s = e.motor_s = e.driven_s = e.since_s = 1;
  for (const TrackView& view : set.views()) {
    const std::vector<Sample>& samples = view.track->samples;
    const std::size_t stride = std::max<std::size_t>(1, samples.size() / 200);
    for (std::size_t i = 0; i < samples.size(); i += stride) {
      xs.push_back(samples[i].x_mm);
      ys.push_back(samples[i].y_mm);
    }
    if (std::find(e.runs.begin(), e.runs.end(), view.number) == e.runs.end()) e.runs.push_back(view.number);
    const double end_s = samples.back().time_s;
    const CommandState last = view.clock.at(end_s);
    e.duration_s = std::max(e.duration_s, end_s);
    e.motor_s = std::max({e.motor_s, last.motor_s[0], last.motor_s[1]});
    e.driven_s = std::max(e.driven_s, last.driven_s);
    for (const CommandChange& change : view.track->commands) {
      e.has_stop = e.has_stop || (change.motion == Motion::kStop && change.time_s > 0);
      e.has_straight = e.has_straight || change.motion == Motion::kStraight;
      e.has_turns = e.has_turns || change.motion == Motion::kLeft || change.motion == Motion::kRight;
    }
  }
  const auto bounds = [](std::vector<double>& all, double& low, double& high) {
    std::sort(all.begin(), all.end());
    low = all[all.size() / 500];
    high = all[all.size() - 1 - all.size() / 500];
    const double margin = std::max(10.0, 0.02 * (high - low));
    low -= margin;
    high += margin;
  };
  bounds(xs, e.x_low_mm, e.x_high_mm);
  bounds(ys, e.y_low_mm, e.y_high_mm);
  e.since_s = std::min(20.0, e.duration_s);
  for (const Run& run : set.set().runs) e.neighbours = e.neighbours || run.tracks.size() > 1;
  e.headings = set.set().has_headings;
  e.robots = set.set().robots();
  return e;
}

Dictionary dictionary_of(const Extent& extent, const std::vector<Term>& found) {
  Dictionary dictionary;
  Catalogue catalogue(extent, dictionary);
  catalogue.fill();
  catalogue.of_found(found);
  catalogue.finish();
  return dictionary;
}

Term Dictionary::term_of(const Hypothesis& hypothesis, double relative_scale) const {
  Term term;
  term.name = hypothesis.name;
  std::vector<double> precision;
  Eigen::Index first = 0;
  std::size_t next = 0;
  for (const Block& block : blocks) {
    const auto n = static_cast<Eigen::Index>(block.basis.size());
    std::vector<std::uint32_t> own;
    while (next < hypothesis.columns.size() && hypothesis.columns[next] < first + n) {
      const Eigen::Index column = hypothesis.columns[next++];
      own.push_back(static_cast<std::uint32_t>(column - first));
      const double sd = relative_scale * scale[column];
      precision.push_back(1 / (sd * sd));
    }
    first += n;
    if (own.empty()) continue;
    Block part = block;
    if (own.size() < static_cast<std::size_t>(n)) part.basis.chosen = own;
    term.blocks.push_back(std::move(part));
  }
  term.precision = Eigen::Map<Eigen::VectorXd>(precision.data(), static_cast<Eigen::Index>(precision.size()));
  term.coefficients = Eigen::VectorXd::Zero(term.precision.size());
  return term;
}

}  // namespace kilotwin::identify

/// A source that is compiled into every plugin: rand() of the C library draws from the station's stream.
#define KILOTWIN_STATION_NO_GLOBAL_NAMES
#include "kilotwin_station.hpp"

extern "C" {

int rand() noexcept {
  constexpr double kValues = 2147483648.0;
  return static_cast<int>(kilotwin::station::detail::here().uniform() * kValues);
}
void srand(unsigned) noexcept {}
long random() noexcept { return rand(); }
void srandom(unsigned) noexcept {}
double drand48() noexcept { return kilotwin::station::detail::here().uniform(); }

}  // extern "C"

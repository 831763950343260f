#include <kilolib.h>
namespace { template <class T> T twice(T t) { return t + t; } }
class State { public: State() : n(3) {} virtual int value() const { return n; } protected: int n; };
class Walk : public State { public: int value() const { return twice(n); } };
static Walk walk; static State &state = walk;
static message_t *tx() { return 0; }
void setup() {} void loop() { static State once; set_color(state.value() == 6 && once.value() == 3 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_message_tx = tx; kilo_start(setup, loop); return 0; }

/* Writes past the end of arrays reach other variables of the program, or nothing; on the robot they pass unnoticed. */
#include <kilolib.h>
int heard[2] = {1, 1};
int counts[2];
message_t message;
static volatile int index = 20;
static void (*callback)(void);
static int called;
static void note(void) { called = 1; }
message_t* message_tx() { return &message; }
void message_rx(message_t* m, distance_measurement_t* d) { counts[index] = 77; index = index % 40 + 2; }
void setup() { callback = note; counts[0] = 3; }
void loop() {
  counts[index] = 5;
  callback = note;
  callback();
  set_color(counts[0] == 3 && called && heard[0] == 1 ? RGB(3, 0, 0) : RGB(0, 0, 3));
}
int main() { kilo_init(); kilo_message_rx = message_rx; kilo_message_tx = message_tx; kilo_start(setup, loop); return 0; }

#include <kilolib.h>
static const message_t empty = {.data = {1, 2, 3}, .type = NORMAL, .crc = 0};
message_t out = {{9, 8}, 5, 0};
volatile uint8_t left;
message_t *tx() { return &out; }
void success() { left = 1; }
void setup() { out = empty; out.data[3] = 4; out.crc = message_crc(&out); }
void loop() { message_t zero = {0}; zero.crc = message_crc(&zero);
  set_color(out.data[2] == 3 && out.data[3] == 4 && left && zero.crc == 0x9c87 && sizeof(message_t) == 12 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_message_tx = tx; kilo_message_tx_success = success; kilo_start(setup, loop); return 0; }

/* Rings of other sizes than kilolib's own: what is full gives up its oldest entry; nonblocking prints take no time. */
#define RXBUFFER_SIZE 4
#define TXBUFFER_SIZE 2
#define DEBUG
#define NONBLOCKING
#include <kilolib.h>
#include <debug.h>
#include <message_buffered.h>

RB_create(numbers, uint8_t, 8);

static uint8_t wrong;

static void check(uint8_t holds) {
  if (!holds) wrong = 1;
}

static void setup(void) {
  message_t message = {{0}, NORMAL, 0};
  distance_measurement_t strength = {1, 2}, told;
  RB_init(numbers);
  for (uint8_t i = 0; i < 5; ++i) {
    RB_back(numbers) = i;
    RB_pushback(numbers);
  }
  check(RB_size(numbers) == 5 && !RB_full(numbers) && RB_front(numbers) == 0);
  RB_popfront(numbers);
  check(RB_size(numbers) == 4 && RB_front(numbers) == 1);

  check(rxbuffer_size() == 0 && txbuffer_size() == 0 && rxbuffer_peek(&told) == 0 && txbuffer_peek() == 0);
  for (uint8_t i = 0; i < 2; ++i) {
    message.data[0] = i;
    strength.low_gain = i;
    rxbuffer_push(&message, &strength);
  }
  check(rxbuffer_size() == 2 && rxbuffer_peek(&told)->data[0] == 0 && told.low_gain == 0 && told.high_gain == 2);
  rxbuffer_pop();
  check(rxbuffer_size() == 1 && rxbuffer_peek(&told)->data[0] == 1 && told.low_gain == 1);
  rxbuffer_pop();
  rxbuffer_pop();
  check(rxbuffer_size() == 0);
  txbuffer_push(&message);
  check(txbuffer_size() == 1 && txbuffer_peek()->data[0] == 1);
  txbuffer_pop();
  check(txbuffer_size() == 0);
}

static void loop(void) {
  const uint32_t before = kilo_ticks;
  for (int i = 0; i < 20; ++i) printf("%d ", i);
  check(kilo_ticks == before);
  delay(1000 / TICKS_PER_SEC);
  set_color(wrong ? RGB(0, 0, 3) : RGB(3, 0, 0));
}

int main(void) {
  kilo_init();
  debug_init();
  kilo_message_buffered();
  kilo_start(setup, loop);
  return 0;
}

#include <kilolib.h>
extern message_t rx_msg;
extern distance_measurement_t rx_dist;
extern volatile uint8_t rx_busy, tx_mask;
extern uint16_t tx_clock, tx_increment, kilo_irhigh[14], kilo_irlow[14];
distance_measurement_t near_by;
void setup() { near_by.high_gain = kilo_irhigh[3]; near_by.low_gain = kilo_irlow[3]; kilo_tx_period = 1000; }
void loop() { set_color(estimate_distance(&near_by) >= 33 && tx_mask && tx_increment == 255 && kilo_irlow[0] > kilo_irlow[13] && kilo_tx_period == 1000 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }

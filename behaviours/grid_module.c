/* A module of a Kilogrid whose cells tell robots their colour and whether they lie at the rim (experiments/kilogrid-decision.txtpb).
 * The configuration has one octet per cell: the colour in the low four bits, 0x10 at the rim. Robots' reports go to the
 * dispatcher. LED: red for colour 1, blue for colour 2, dark at the rim. */
#include <CAN.h>
#include <module.h>
#include <moduleIR.h>
#include <moduleLED.h>

#include "grid_messages.h"

static void receive(IR_message_t* message, cell_num_t cell, distance_measurement_t* strength, uint8_t wrong) {
  (void)strength;
  if (wrong || message->type != TRACKING) return;
  CAN_message_t* const report = next_CAN_message();
  if (report != NULL) serialize_tracking_message(report, cell, (tracking_user_data_t*)message->data);
}

static void setup(void) {
  for (uint8_t cell = 0; cell < N_CELLS && cell < configuration_size; ++cell) {
    IR_message_t message;
    init_IR_message(&message);
    message.type = CELL_MESSAGE;
    message.data[CELL_COLOUR] = configuration[cell] & 0x0F;
    message.data[CELL_AT_RIM] = configuration[cell] >> 4;
    set_IR_message(&message, (cell_num_t)cell);
    const color_t shown = message.data[CELL_COLOUR] == 1 ? RED : message.data[CELL_COLOUR] == 2 ? BLUE : LED_OFF;
    set_LED_with_brightness((cell_num_t)cell, shown, LOW);
  }
}

static void loop(void) {}

int main(void) {
  module_init();
  module_IR_message_rx = receive;
  module_start(setup, loop);
  return 0;
}

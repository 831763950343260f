/* Does not compile: Validation.programs_that_do_not_run_fail. */
#include <kilolib.h>

int main(void) { kilo_start(missing, missing); }

/* Compiled with programs that work only with Kilombo. It provides memory for their user data if they leave that to the
 * simulator, and defines the callbacks that they set. No callback is called. */
#include <jansson.h>
#include <stdint.h>
#include <stdlib.h>

enum { OCTETS = 8192 };

extern int UserdataSize __attribute__((weak));
extern void* mydata __attribute__((weak));

static unsigned long long room[OCTETS / 8];

__attribute__((constructor)) static void make_room(void) {
  if (&UserdataSize == NULL || &mydata == NULL || mydata != NULL) return;
  if (UserdataSize > OCTETS) abort();
  mydata = room;
}

#pragma weak callback_F5
#pragma weak callback_F6
#pragma weak callback_botinfo
#pragma weak callback_params
#pragma weak callback_reset
#pragma weak callback_global_setup
#pragma weak callback_json_state
void (*callback_F5)(void) = NULL;
void (*callback_F6)(void) = NULL;
char* (*callback_botinfo)(void) = NULL;
void (*callback_params)(void) = NULL;
void (*callback_reset)(void) = NULL;
void (*callback_global_setup)(void) = NULL;
json_t* (*callback_json_state)(void) = NULL;

/* Declarations for Kilombo's json_state callbacks. The callbacks are never called here, so the functions have no definitions.
 * The recording of a run holds the robots' states (kilotwin export). */
#ifndef KILOTWIN_JANSSON_H
#define KILOTWIN_JANSSON_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct json_t json_t;
typedef long long json_int_t;
typedef struct {
  int line;
  char text[80];
} json_error_t;

json_t* json_object(void);
json_t* json_array(void);
json_t* json_integer(json_int_t value);
json_t* json_real(double value);
json_t* json_string(const char* text);
json_t* json_boolean(int value);
json_t* json_true(void);
json_t* json_false(void);
json_t* json_null(void);
json_t* json_pack(const char* format, ...);
int json_object_set(json_t* object, const char* key, json_t* value);
int json_object_set_new(json_t* object, const char* key, json_t* value);
json_t* json_object_get(const json_t* object, const char* key);
int json_array_append(json_t* array, json_t* value);
int json_array_append_new(json_t* array, json_t* value);
json_t* json_array_get(const json_t* array, size_t index);
size_t json_array_size(const json_t* array);
json_int_t json_integer_value(const json_t* integer);
double json_real_value(const json_t* real);
double json_number_value(const json_t* number);
const char* json_string_value(const json_t* string);
int json_is_true(const json_t* value);
json_t* json_incref(json_t* value);
void json_decref(json_t* value);
int json_dump_file(const json_t* value, const char* path, size_t flags);
char* json_dumps(const json_t* value, size_t flags);
json_t* json_load_file(const char* path, size_t flags, json_error_t* error);

#ifdef __cplusplus
}
#endif

#endif

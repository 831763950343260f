/* Kilombo's parameters. Every parameter has the default that the program passes. */
#ifndef KILOTWIN_PARAMS_H
#define KILOTWIN_PARAMS_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define get_int_param(name, otherwise) (otherwise)
#define get_float_param(name, otherwise) (otherwise)
#define get_string_param(name, otherwise) (otherwise)
#define get_array_param_size(name) 0
#define get_int_array_param(name, index, otherwise) (otherwise)
#define get_float_array_param(name, index, otherwise) (otherwise)

#endif

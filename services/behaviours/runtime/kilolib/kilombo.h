/* For programs written for Kilombo. They run here as on the robot: every robot has its own globals, mydata points to one of
 * them, and no callback of the simulator is called. The names for programs that need SIMULATOR are here too. */
#ifndef KILOTWIN_KILOMBO_H
#define KILOTWIN_KILOMBO_H

#include <kilolib.h>

#ifdef SIMULATOR
#define REGISTER_USERDATA(type)    \
  int UserdataSize = sizeof(type); \
  type* mydata;
#else
#define REGISTER_USERDATA(type) \
  type myuserdata;              \
  type* mydata = &myuserdata;
#endif

#define SET_CALLBACK(event, function)

#ifdef SIMULATOR
#include <jansson.h>
#include <params.h>
#define register_callback(event, function) ((void)0)
#define register_user_lighting(function) ((void)0)
#define register_user_obstacles(function) ((void)0)
#define set_callback_params(function) ((void)0)
#define set_callback_reset(function) ((void)0)
#define set_callback_botinfo(function) ((void)0)
#define set_callback_json_state(function) ((void)0)
#define set_callback_global_setup(function) ((void)0)
#define set_callback_obstacles(function) ((void)0)
#define set_callback_lighting(function) ((void)0)
#endif

#endif

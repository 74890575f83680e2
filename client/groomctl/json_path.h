/* Values of a command line as JSON, and the places they go to. */
#ifndef GROOMCTL_JSON_PATH_H
#define GROOMCTL_JSON_PATH_H

#include <cjson/cJSON.h>

/* JSON where the text is JSON ("12", "true", "[1,2]"), else a string. NULL where memory is out. */
cJSON *json_value(const char *text);

/* Put "path=value" into an object: path is dotted (stages.initialize.n_smooth) or a JSON pointer
 * (/stages/initialize/n_smooth); objects on the way are made.
 * returns  1; 0 where there is no "=", no name, or something on the way is not an object */
int json_set_path(cJSON *object, const char *assignment);

#endif

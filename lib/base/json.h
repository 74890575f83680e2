/* What cJSON leaves to be wished for. */
#ifndef BASE_JSON_H
#define BASE_JSON_H

#include <cjson/cJSON.h>

/* A number that reads back to the same bits, in as few digits as that takes; cJSON itself prints 15
 * digits of it where those come near. value is finite. NULL where memory is out. */
cJSON *json_number(double value);

/* Puts item into object under that name; item is taken also where that fails. returns 1, or 0 (item NULL, or
 * memory is out) */
int json_put(cJSON *object, const char *name, cJSON *item);

#endif

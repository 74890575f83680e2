/* `groomd token create|list|revoke`: works on the data folder, whether a daemon runs on it or not. */
#ifndef ACCESS_COMMAND_H
#define ACCESS_COMMAND_H

/* argv[0] is "token". returns  the exit status: 0 done, 1 refused, 2 wrong usage */
int access_command(int argc, char *const *argv, char *const *environment);

#endif

/* `groomd check` and `groomd backup`: of the daemon that runs on the folder, or else by ourselves. */
#ifndef UPKEEP_COMMAND_H
#define UPKEEP_COMMAND_H

/* argv[0] is "check" or "backup". returns  the exit status: 0 fine, 1 problems or refused, 2 wrong usage */
int upkeep_command(int argc, char **argv, char *const *environment);

#endif

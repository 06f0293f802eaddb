/* Ends the calling function with 1, and a message, where a call of the library fails. */
#ifndef EXAMPLES_CHECK_H
#define EXAMPLES_CHECK_H

#include <isocoat/isocoat.h>

#include <stdio.h>

#define CHECK(call)                                                     \
    do {                                                                \
        if ((call) != ISOCOAT_OK) {                                     \
            char message[256];                                          \
            isocoat_last_error(message, sizeof message);                \
            fprintf(stderr, "%s: %s\n", #call, message);                \
            return 1;                                                   \
        }                                                               \
    } while (0)

#endif

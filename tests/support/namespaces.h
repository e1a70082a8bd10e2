/* Namespaces of a test's own: mounts and networks that nobody else sees.
 *
 * For a child process that the test forks. Works for root and, where the kernel lets ordinary users
 * make user namespaces, for everyone. */
#ifndef SHEF_TESTS_SUPPORT_NAMESPACES_H
#define SHEF_TESTS_SUPPORT_NAMESPACES_H

#include <stdbool.h>

/* Moves the calling process, which has one thread, into namespaces of its own.
 *   flags  CLONE_NEWNS, CLONE_NEWNET or both; mounts are made private
 * Returns false where this user may not. */
bool shef_test_enter_namespaces(int flags);

/* In a network of one's own, which has nothing but a loopback device, down at first. Taking it down
 * takes its routes. */
void shef_test_set_loopback(bool is_up);

/* As "ip route add ADDRESS/32 dev lo". */
void shef_test_add_route(const char *address);

#endif

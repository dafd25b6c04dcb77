/* SPDX-License-Identifier: MIT */
/* sanitized.h - whether this program was built with a sanitizer, which makes it some twenty times as slow. */
#ifndef SONARD_TEST_SANITIZED_H
#define SONARD_TEST_SANITIZED_H

#include <stdbool.h>

#ifdef __has_feature /* clang's */
#define SANITIZED_CLANG (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#else
#define SANITIZED_CLANG 0
#endif

static inline bool sanitized(void)
{
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || SANITIZED_CLANG
    return true;
#else
    return false;
#endif
}

#endif

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Compiles a function once for each width of vectors and picks at the start of the program what
/// the machine has. Without fused products (-ffp-contract=off) all of them find the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define TRUEBOX_MANY_TARGETS \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define TRUEBOX_MANY_TARGETS
#endif

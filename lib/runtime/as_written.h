/* The run-time code is compiled as written, independent of the compiler's flags: no fused
 * multiply-add, and no call of the C library where the source has a loop.
 *
 * A fused multiply-add rounds once where the source rounds twice, so the results of cores with and
 * without it would differ. GCC fuses by default in its gnu dialects. Clang keeps to the pragma
 * unless it gets -ffp-contract=fast, which overrules the source. */
#ifndef LOSTMOTION_RUNTIME_AS_WRITTEN_H
#define LOSTMOTION_RUNTIME_AS_WRITTEN_H

#include "runtime/no_fast_math.h"

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("fp-contract=off", "no-tree-loop-distribute-patterns")
#elif defined(_MSC_VER) && !defined(__clang__)
#pragma fp_contract(off)
#else
#pragma STDC FP_CONTRACT OFF
#endif

#endif

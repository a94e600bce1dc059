// Tells whether a planted bug (common/render/planted_bugs.h) is on. In release builds the preprocessor removes it, so they
// contain no code of planted bugs.
#ifndef PLANTED_GLSL
#define PLANTED_GLSL

#include "made/constant_ids.glsl"

#ifdef PLANTED_BUGS
layout(constant_id = id_planted_amount) const float planted_amount = 0.0;
layout(constant_id = id_planted_bug) const uint planted_bug = 0;
#include "planted_bugs.glsl"  // bug_none, ...: written by shaders/tools/planted_bugs.py
#define PLANTED(bug) (planted_bug == bug_##bug)
#define PLANT(bug, faulty, sound) (PLANTED(bug) ? (faulty) : (sound))
#define PLANT_SCALE(bug, sound) ((sound) * (PLANTED(bug) ? 1.0 + planted_amount : 1.0))
#define PLANTED_REACH(sound) (PLANT_SCALE(shadow_limit_long, sound) * (PLANTED(shadow_limit_short) ? 1.0 - planted_amount : 1.0))
#else
#define PLANTED(bug) false
#define PLANT(bug, faulty, sound) (sound)
#define PLANT_SCALE(bug, sound) (sound)
#define PLANTED_REACH(sound) (sound)
#endif

#endif

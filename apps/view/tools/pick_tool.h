#pragma once

#include "apps/view/tools/tool.h"

namespace palpate::view {

// Takes what is under the pointer into use. On a label a click takes the label, in slices and in
// 3D. Beside labels a drag in a slice takes the range of the grey values that it passes over: tools
// on labels then change no other samples (ViewState::only_values).
extern const Tool kPickTool;

} // namespace palpate::view

/// A bounded list of what was read for different questions, so that viewers who ask alternately do not undo each other's work.
#pragma once

#include <algorithm>
#include <cstddef>
#include <list>

namespace kilotwin::view {

/// The entry of a list for which `is` holds, moved to its front; `fresh` where there is none. Of more than `most`, the one that was
/// used longest ago goes.
template <class Entry, class Is>
Entry& recently_used(std::list<Entry>& list, std::size_t most, const Is& is, Entry fresh) {
  if (const auto found = std::find_if(list.begin(), list.end(), is); found != list.end()) {
    list.splice(list.begin(), list, found);
    return list.front();
  }
  if (list.size() >= most) list.pop_back();
  return list.emplace_front(std::move(fresh));
}

}  // namespace kilotwin::view

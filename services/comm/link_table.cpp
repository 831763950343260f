#include "services/comm/link_table.hpp"

#include <algorithm>

namespace kilotwin::comm {

LinkTable::LinkTable(Neighbourhood& neighbourhood, LinkBudget& links)
    : neighbourhood_(neighbourhood), links_(links) {
  if (links.is_disc()) return;
  touched_.assign(neighbourhood.cells(), 0);
  built_.assign(neighbourhood.robots(), 0);
  checked_ = built_;
  row_.resize(neighbourhood.robots());
}

void LinkTable::move(std::uint32_t robot, double x_mm, double y_mm, double heading_rad) {
  const std::uint32_t from = neighbourhood_.cell_of(robot);
  const bool turned = links_.turn(robot, heading_rad), moved = neighbourhood_.place(robot, x_mm, y_mm);
  if (!turned && !moved) return;
  touched_[from] = now_;
  touched_[neighbourhood_.cell_of(robot)] = now_;
}

void LinkTable::refresh(std::uint32_t sender) {
  // All receivers, and all bodies between them and the sender, are in the cells around the sender.
  std::uint32_t latest = 0;
  neighbourhood_.visit_cells(sender, 1, [&](std::uint32_t cell) { latest = std::max(latest, touched_[cell]); });
  checked_[sender] = now_;
  if (built_[sender] != 0 && latest <= built_[sender]) return;
  built_[sender] = now_;
  std::vector<Link>& row = row_[sender];
  row.clear();
  neighbourhood_.visit(sender, [&](std::uint32_t receiver, double) {
    const double margin_db = links_.margin_db(neighbourhood_, sender, receiver);
    if (margin_db > links_.floor_db()) row.push_back({receiver, static_cast<float>(margin_db)});
  });
}

bool LinkTable::notices(std::uint32_t receiver, std::uint32_t sender) {
  if (!used()) return links_.hears(neighbourhood_, receiver, sender);
  for (const Link& link : of(sender)) {
    if (link.receiver == receiver) return link.margin_db > -static_cast<float>(links_.notice_db());
  }
  return false;
}

void LinkTable::clear() {
  std::fill(built_.begin(), built_.end(), 0u);
  std::fill(checked_.begin(), checked_.end(), 0u);
}

}  // namespace kilotwin::comm

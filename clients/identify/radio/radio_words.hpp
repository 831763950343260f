/// The result of a radio fit as the document that pages and result.json are written from.
#pragma once

#include "clients/identify/identify.hpp"
#include "idl/identification.pb.h"
#include "idl/model.pb.h"

namespace kilotwin::radio_fit {

/// `fit`: its first step is the base model.
[[nodiscard]] identify::Identified identified_of(const identification::RadioFit& fit, proto::Model model);

}  // namespace kilotwin::radio_fit

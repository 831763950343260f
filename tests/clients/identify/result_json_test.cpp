// result.json keeps the keys that scripts read.
#include "clients/identify/result/result_json.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "clients/identify/result/values.hpp"

namespace kilotwin::identify {
namespace {

using nlohmann::json;

TEST(ResultJson, ListsAreThereEvenIfEmpty) {
  const json result = json_of(identification::Result());
  for (const char* key : {"effects", "rejected", "ambiguous", "faults"})
    EXPECT_EQ(result.at(key), json::array()) << key;
  identification::Result checked;
  checked.mutable_check();
  EXPECT_EQ(json_of(checked).at("check"), (json{{"path", json::array()}, {"kept", 0}, {"dropped", json::array()}}));
}

TEST(ResultJson, WhatBelongsToOtherKindsOfDataIsAbsent) {
  const json result = json_of(identification::Result());
  EXPECT_EQ(result.size(), 4U) << result.dump();
}

TEST(ResultJson, UnknownNumbersAreNull) {
  identification::Result result;
  *result.mutable_before()->mutable_rmse_mm() = json_null();
  *result.mutable_after()->mutable_rmse_mm() = json_value(std::numeric_limits<double>::infinity());
  result.mutable_before()->set_rows(0);
  result.mutable_unexplained();
  const json written = json_of(result);
  EXPECT_EQ(written.at("before"), (json{{"rmse_mm", nullptr}, {"rows", 0}}));
  EXPECT_EQ(written.at("after"), (json{{"rmse_mm", nullptr}}));
  EXPECT_TRUE(written.at("unexplained").at("learner").is_null());
  result.set_noise_floor_mm(std::numeric_limits<double>::quiet_NaN());
  result.mutable_replicates()->set_floor_mm(-std::numeric_limits<double>::infinity());
  result.add_faults()->set_run("NaN");
  const json unknown = json_of(result);
  EXPECT_TRUE(unknown.at("noise_floor_mm").is_null());
  EXPECT_TRUE(unknown.at("replicates").at("floor_mm").is_null());
  EXPECT_EQ(unknown.at("faults").at(0).at("run"), "NaN");
}

TEST(ResultJson, NumbersKeepTheirValues) {
  identification::Result result;
  for (const double value : {0.1 + 0.2, 1e-300, -212.0, 1e17}) {
    result.set_noise_floor_mm(value);
    *result.mutable_before()->mutable_rmse_mm() = json_value(value);
    const json written = json_of(result);
    EXPECT_EQ(written.at("noise_floor_mm").get<double>(), value);
    EXPECT_EQ(written.at("before").at("rmse_mm").get<double>(), value);
  }
  result.mutable_fitted_runs_themselves()->insert({"comm_tau000", {}});
  EXPECT_EQ(json_of(result).at("fitted_runs_themselves").at("comm_tau000").at("deficit"), 0);
}

}  // namespace
}  // namespace kilotwin::identify

#include "clients/report/html.hpp"

#include <gtest/gtest.h>

#include <cctype>

namespace kilotwin::html {
namespace {

TEST(Html, ATableHasHeadsAndRows) {
  Table table({"a", "<b>b</b>"});
  table.row({"1", escaped("<2>")});
  table.row({"3", "4"});
  EXPECT_EQ(
      table.text("facts"),
      "<div class=\"scroll\"><table class=\"facts\"><thead><tr><th>a</th><th><b>b</b></th></tr></thead><tbody>\n"
      "<tr><td>1</td><td>&lt;2&gt;</td></tr>\n<tr><td>3</td><td>4</td></tr>\n</tbody></table></div>\n");
  const std::string empty = Table(std::vector<std::string>{"x"}).text();
  EXPECT_NE(empty.find("<table><thead><tr><th>x</th></tr></thead><tbody>"), std::string::npos) << empty;
}

TEST(Html, APageHoldsTitleStyleAndBody) {
  const std::string whole = page("a & b", "<p>body {{name}}</p>\n");
  EXPECT_TRUE(whole.starts_with("<!DOCTYPE html>"));
  EXPECT_NE(whole.find("<title>a &amp; b</title>"), std::string::npos);
  EXPECT_NE(whole.find("<body>\n<p>body {{name}}</p>\n</body></html>"), std::string::npos)
      << "a body is no template";
  EXPECT_NE(whole.find("@media print"), std::string::npos);
}

TEST(Html, ColoursFollowTheScheme) {
  std::string style = page("", "");
  EXPECT_NE(style.find("@media screen and (prefers-color-scheme: dark)"), std::string::npos);
  // Every colour is a variable: those of :root alone are stated.
  for (std::size_t at = 0; (at = style.find(":root {", at)) != std::string::npos;)
    style.erase(at, style.find('}', at) - at);
  for (std::size_t at = 0; (at = style.find('#', at)) != std::string::npos; ++at)
    EXPECT_EQ(std::isxdigit(static_cast<unsigned char>(style[at + 1])), 0) << style.substr(at, 40);
}

TEST(Html, PlotsTakeTheInkOfThePageAndPicturesKeepTheirGround) {
  EXPECT_TRUE(image("<svg/>", "a plot").starts_with("<img class=\"plot\" alt=\"a plot\" src=\"data:"));
  EXPECT_TRUE(image("<svg/>", "a picture", Ground::kOwn).starts_with("<img alt=\"a picture\" src=\"data:"));
}

TEST(Html, TemplatesEscapeText) {
  Data data{Data::type::object};
  data.set("name", "<i>\x01\xff&\"");
  EXPECT_EQ(rendered("{{name}} {{{name}}}", data), "&lt;i&gt;??&amp;&quot; <i>\x01\xff&\"");
}

}  // namespace
}  // namespace kilotwin::html

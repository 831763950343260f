# cmake -DOUTPUT=FILE.cpp -DNAMES=a;b -DPATHS=/x/a;/y/b -P embed.cmake: writes a C++ source with the contents of the files.
set(arrays "")
set(rows "")
set(index 0)
foreach(name path IN ZIP_LISTS NAMES PATHS)
  file(READ ${path} octets HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," octets "${octets}")
  string(REGEX REPLACE "(0x[^,]*,0x[^,]*,0x[^,]*,0x[^,]*,0x[^,]*,0x[^,]*,0x[^,]*,0x[^,]*,0x[^,]*,0x[^,]*,0x[^,]*,0x[^,]*,)"
         "\\1\n" octets "${octets}")
  string(APPEND arrays "constexpr char kFile${index}[] = {${octets}0};\n")
  string(APPEND rows "    {\"${name}\", {kFile${index}, sizeof kFile${index} - 1}},\n")
  math(EXPR index "${index} + 1")
endforeach()
file(WRITE ${OUTPUT} "// Generated from services/behaviours/runtime.
#include \"services/behaviours/runtime_files.hpp\"

namespace kilotwin::behaviours {
namespace {
${arrays}
constexpr RuntimeFile kFiles[] = {
${rows}};
}  // namespace

std::span<const RuntimeFile> runtime_files() { return kFiles; }

}  // namespace kilotwin::behaviours
")

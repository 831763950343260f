# Writes build_identity.cpp: sources and compiler of this program. Run by cmake -P with SOURCES (the project's folder), OUTPUT,
# VERSION and COMPILER. The identity covers the compiler with its version, and all files that can change a result or the wire
# format. It does not cover paths, times or machines: the same sources and compiler give the same identity anywhere.
set(patterns "")
foreach(folder core services idl)
  foreach(ending cpp hpp h c S proto idl txt)
    list(APPEND patterns "${SOURCES}/${folder}/*.${ending}")
  endforeach()
endforeach()
file(GLOB_RECURSE files RELATIVE ${SOURCES} ${patterns})
list(APPEND files cmake/KilotwinTargets.cmake)
list(SORT files)
set(contents "${COMPILER}")
foreach(file ${files})
  file(SHA256 "${SOURCES}/${file}" hash)
  string(APPEND contents "\n${hash} ${file}")
endforeach()
string(SHA256 identity "${contents}")
string(SUBSTRING "${identity}" 0 16 identity)
file(WRITE "${OUTPUT}"
  "// Written by cmake/BuildIdentity.cmake.\n#include \"core/base/build_identity.hpp\"\n\nnamespace kilotwin {\n"
  "std::string_view build_identity() { return \"${VERSION}-${identity}\"; }\n"
  "std::string_view build_compiler() { return \"${COMPILER}\"; }\n}  // namespace kilotwin\n")

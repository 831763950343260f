# cmake -DNPM= -DPAGE= -DWORK= -DOUT= -DSTAMP= -P build.cmake: builds the page in PAGE to OUT, and writes STAMP.
find_program(node node)
set(vite ${NPM}/node_modules/vite/bin/vite.js)
if(NOT node OR NOT EXISTS ${vite} OR NOT EXISTS ${NPM}/node_modules/uplot)
  message(NOTICE "the page of kilotwin view is not built: it needs Node.js and the npm packages that scripts/setup installs")
  return()
endif()
# Vite finds packages in node_modules beside the sources, so it works on a copy.
file(REMOVE_RECURSE ${WORK}/sources)
file(COPY ${PAGE}/ DESTINATION ${WORK}/sources)
file(CREATE_LINK ${NPM}/node_modules ${WORK}/sources/node_modules SYMBOLIC)
execute_process(COMMAND ${node} ${vite} build --outDir ${OUT} --emptyOutDir --logLevel warn
  WORKING_DIRECTORY ${WORK}/sources RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "the page of kilotwin view could not be built; Vite's words stand above")
endif()
file(TOUCH ${STAMP})

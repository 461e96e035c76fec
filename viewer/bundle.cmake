# cmake -DNPM= -DNODE= -DSOURCE= -DOUTPUT= -P bundle.cmake: view3d.js with three.js in one file, or an
# empty file with a warning when npm is not there or cannot fetch. The build goes on either way.
get_filename_component(work ${OUTPUT} DIRECTORY)
set(work ${work}/npm)
set(failed "")

# Runs ARGN in the work folder; sets `failed` to what it said when it fails.
function(run)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${work} TIMEOUT 180 RESULT_VARIABLE result
                  OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT result EQUAL 0)
    set(failed "${result}: ${out}" PARENT_SCOPE)
  endif()
endfunction()

file(MAKE_DIRECTORY ${work})
if(NOT NPM)
  set(failed "npm or node is not there, or LAMINA_REPORT_3D is off")
else()
  file(COPY ${SOURCE}/package.json ${SOURCE}/package-lock.json ${SOURCE}/src/view3d.js
            ${SOURCE}/src/fly.js ${SOURCE}/src/shapes.js DESTINATION ${work})
  file(SHA256 ${work}/package-lock.json wanted)
  set(installed "")
  if(EXISTS ${work}/node_modules/.lamina)
    file(READ ${work}/node_modules/.lamina installed)
  endif()
  if(NOT installed STREQUAL wanted)
    run(${NPM} ci --ignore-scripts --no-audit --no-fund --fetch-retries=1 --fetch-timeout=30000)
    if(NOT failed)
      file(WRITE ${work}/node_modules/.lamina ${wanted})
    endif()
  endif()
  if(NOT failed)
    run(${NODE} node_modules/esbuild/bin/esbuild view3d.js --bundle --minify --format=iife
        --charset=ascii --legal-comments=inline --log-level=warning --outfile=${OUTPUT})
  endif()
endif()
if(failed)
  message(WARNING "report.html will have no 3D view: ${failed}")
  file(WRITE ${OUTPUT} "")
endif()

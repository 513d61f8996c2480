# The page that `squint report` fills, from its parts (page/) and the charts' libraries (libraries/, which `bundle` fetches).
# Its security policy names each script and style by its hash.
#   cmake -DPAGE=<the page to write> -P assemble.cmake
cmake_minimum_required(VERSION 3.20)
set(here ${CMAKE_CURRENT_LIST_DIR})
# Each after what it calls when it is read.
set(scripts data.js charts.js pareto.js sensitivity.js heat.js ranges.js search.js pictures.js table.js page.js)
file(GLOB others RELATIVE ${here}/page ${here}/page/*.js)
list(REMOVE_ITEM others ${scripts})
if(others)
  message(FATAL_ERROR "assemble.cmake: scripts says nothing of page/${others}")
endif()

# 'sha256-...', as a security policy writes it: the hash in base64, three bytes in four letters.
function(policy_hash result text)
  set(letters ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/)
  string(SHA256 hex "${text}")
  set(base64 "")
  foreach(at RANGE 0 60 6)
    string(SUBSTRING ${hex}00 ${at} 6 bytes)
    foreach(shift 18 12 6 0)
      math(EXPR letter "(0x${bytes} >> ${shift}) & 63")
      string(SUBSTRING ${letters} ${letter} 1 letter)
      string(APPEND base64 ${letter})
    endforeach()
  endforeach()
  string(SUBSTRING ${base64} 0 43 base64)  # the last letter was of the byte that is not there
  set(${result} "'sha256-${base64}='" PARENT_SCOPE)
endfunction()

file(READ ${here}/libraries/libraries.js library)
file(READ ${here}/libraries/libraries.css style)
file(READ ${here}/libraries/licences.html licences)
file(READ ${here}/page/page.css own_style)
string(APPEND style "${own_style}")
# One scope, closed to the page.
set(script "'use strict';\n(() => {\n")
set(between "")
foreach(name ${scripts})
  file(READ ${here}/page/${name} part)
  string(APPEND script "${between}${part}")
  set(between "\n")
endforeach()
string(APPEND script "})();\n")
string(REPLACE "</script" "<\\/script" script "${script}")
string(REPLACE "<!--" "<\\!--" script "${script}")

policy_hash(library_hash "${library}")
policy_hash(script_hash "${script}")
policy_hash(style_hash "${style}")
set(policy "default-src 'none'; script-src ${library_hash} ${script_hash}; style-src ${style_hash}; ")
string(APPEND policy "connect-src 'none'; base-uri 'none'; form-action 'none'")

file(READ ${here}/page/page.html page)
foreach(part policy style licences library script)
  string(TOUPPER "@${part}@" place)
  string(REPLACE "${place}" "${${part}}" page "${page}")
endforeach()
file(WRITE ${PAGE} "${page}")

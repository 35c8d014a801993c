-- The only chunk that runs in a Lua state; evaluates one expression. All functions that the guards
-- use are local variables, so that an expression that changes globals can neither read nor replace
-- them.
local code, spent, time_limit, memory_limit, interval, seed = ...
local error, ipairs, pairs, pcall, rawget, select, tonumber, tostring, type, unpack =
  error, ipairs, pairs, pcall, rawget, select, tonumber, tostring, type, unpack
local clock, getenv, sethook, memory_used = os.clock, os.getenv, debug.sethook, collectgarbage
local loadstring, create, resume = loadstring, coroutine.create, coroutine.resume
local byte, find, format, gsub, rep = string.byte, string.find, string.format, string.gsub, string.rep
local sub, concat, insert, date = string.sub, table.concat, table.insert, os.date

local known = {}  -- by parameter name: a table that holds the value, empty for an unset parameter
local given = {select(7, ...)}
for i = 1, select("#", ...) - 6, 2 do known[given[i]] = {given[i + 1]} end

if jit then jit.off() end  -- compiled code does not call hooks
for _, name in ipairs{"execute", "exit", "remove", "rename", "tmpname", "setlocale"} do
  os[name] = nil
end
for name in pairs(package.loaded) do package.loaded[name] = nil end
-- newproxy creates objects with finalizers, which run without hooks
for _, name in ipairs{"io", "package", "require", "module", "dofile", "loadfile", "debug",
                      "python", "newproxy", "jit", "ffi"} do
  _G[name] = nil
end

-- The hook runs every few instructions and before each function, also before those of the library:
-- a loop of few instructions could otherwise call slow functions many times between two checks.
-- Once `stopped` is set, functions that catch errors raise it again, so that the expression ends.
local stopped, requested, ended
local start = clock() - spent
local check
function check()
  if ended then return end
  if not stopped and clock() - start > time_limit then
    stopped = "the time limit of " .. time_limit .. " s is exceeded"
  elseif not stopped and memory_used("count") * 1024 > memory_limit then
    stopped = "not enough memory"
  end
  if stopped then
    sethook(check, "c", interval)  -- LuaJIT does not restart the count after an error
    error(stopped, 0)
  end
end
local function pass(...)
  if stopped then error(stopped, 0) end
  return ...
end

function _G.pcall(...) return pass(pcall(...)) end
-- The built-in xpcall runs the handler inside the hook that failed, where hooks are disabled.
function _G.xpcall(run, handler)
  local function finish(ok, ...)
    if ok then return true, ... end
    return false, select(2, pass(pcall(handler, ...)))
  end
  return finish(pass(pcall(run)))
end
function coroutine.create(run)
  local thread = create(run)
  sethook(thread, check, "c", interval)  -- hooks are set per coroutine
  return thread
end
local create_hooked = coroutine.create
function coroutine.resume(...) return pass(resume(...)) end
function coroutine.wrap(run)
  local thread = create_hooked(run)
  local function finish(ok, ...)
    if not ok then error((...), 0) end
    return ...
  end
  return function(...) return finish(pass(resume(thread, ...))) end
end

-- The generator of Park and Miller (1988), whose state is local: that of the C library is shared by
-- the whole process, so that other code would change the results.
local floor, state = math.floor, 1
function math.randomseed(number)
  state = floor(tonumber(number) or 0) % 2147483646 + 1
  if state ~= state then state = 1 end
  for _ = 1, 3 do state = 16807 * state % 2147483647 end  -- similar seeds, different numbers
end
function math.random(first, last)
  state = 16807 * state % 2147483647
  local fraction = (state - 1) / 2147483646
  if first == nil then return fraction end
  local low, high = tonumber(last and first or 1), tonumber(last or first)
  if not (low and high and low <= high) then error("interval is empty", 2) end
  return floor(low) + floor(fraction * (floor(high) - floor(low) + 1))
end
math.randomseed(seed)

-- Text only: a forged binary chunk can corrupt the memory of the process.
function _G.loadstring(text, name)
  check()
  if type(text) == "string" and byte(text, 1) == 27 then
    return nil, "binary chunks are not allowed"
  end
  return loadstring(text, name)
end
local load_text = _G.loadstring
function _G.load(reader, name)
  if type(reader) == "string" then return load_text(reader, name) end
  local pieces = {}
  while true do
    local piece = reader()
    if piece == nil or piece == "" then break end
    pieces[#pieces + 1] = piece
  end
  return load_text(concat(pieces), name or "=(load)")
end

-- A single call of one of these functions can take arbitrarily long without running a hook.
-- Therefore the cost is estimated and limited before the call.
local function limit(steps, message)
  check()
  if steps > 2e8 then error(message, 3) end  -- about 1 s
end
-- Not tostring, whose result for strings depends on a metatable that the expression can change.
local function text_of(value)
  local kind = type(value)
  return kind == "string" and value or kind == "number" and tostring(value) or ""
end
local function guard(name, plain_allowed)
  local run = string[name]
  string[name] = function(text, pattern, third, plain)
    local n, m = #text_of(text), #text_of(pattern)
    if plain_allowed and plain then
      limit(n * m / 16, "the text to find is too long")
    else
      if m > 1000 then error("the pattern has more than 1000 characters", 2) end
      -- %b and %1 also scan the text; a set counts as a single character
      local bare = gsub(gsub(text_of(pattern), "%%[b%d]", "x*"), "%%.", "x")
      local longest = 0  -- characters of a set, with each of which a character is compared
    bare = gsub(bare, "%[%^?.[^%]]*%]", function(set)
      if #set > longest then longest = #set end
      return "x"
    end)
      local _, repeated = gsub(bare, "[*+-]", "")
      local _, optional = gsub(bare, "%?", "")
      local steps = (byte(bare, 1) == 94 and 1 or n + 1) * 2 ^ optional * (1 + #bare / 8)
      for i = 1, repeated do steps = steps * (n + i) / i end
      if longest > 16 then steps = steps * longest / 8 end
      limit(steps, "the pattern may take too long for a text of " .. n .. " characters")
    end
    if name == "gsub" and (n + 1) * #text_of(third) > memory_limit then
      error("not enough memory", 2)
    end
    if name == "gsub" and type(third) == "table" then
      local values = third  -- hooks run inside a Lua function, and limit the size of the result
      third = function(key) return values[key] end
    end
    return run(text, pattern, third, plain)
  end
end
guard("find", true) guard("match") guard("gmatch") guard("gsub")
string.gfind = nil
function string.rep(text, count)
  local size = #text_of(text)
  if size == 0 then return "" end
  if (tonumber(count) or 0) * size > memory_limit then error("not enough memory", 2) end
  return rep(text, count)
end
function string.format(text, ...)
  local size = #text_of(text)
  for i = 1, select("#", ...) do size = size + 4 * #text_of((select(i, ...))) end  -- 4 for %q
  if size > memory_limit then error("not enough memory", 2) end
  return format(text, ...)
end
function table.concat(list, separator, first, last)
  if type(list) == "table" then
    local size, gap = 0, #text_of(separator)
    for i = tonumber(first) or 1, tonumber(last) or #list do
      local item = rawget(list, i)
      if item == nil then break end
      size = size + gap + (type(item) == "string" and #item or 0)
      if size > memory_limit then error("not enough memory", 2) end
    end
  end
  return concat(list, separator, first, last)
end
function os.date(text, time)
  if #text_of(text) > 200 then error("the format has more than 200 characters", 2) end
  return date(text, time)
end
local function is_index(number) return number > -1e9 and number < 1e9 end
function _G.unpack(list, first, last)
  first, last = tonumber(first) or 1, last == nil and #list or tonumber(last) or 0
  -- Lua 5.1 counts with 32 bits here and crashes on overflow
  if not (is_index(first) and is_index(last) and last - first < 7000) then
    error("too many results to unpack", 2)
  end
  return unpack(list, first, last)
end
function table.insert(list, ...)
  local position = tonumber((...)) or 0
  if select("#", ...) > 1 and not (position >= 0 and is_index(position)) then
    error("position out of bounds", 2)
  end
  return insert(list, ...)
end

-- The terminal is not a part of the sandbox: the text is returned, and becomes a line of the log.
local printed, room = {}, 2000  -- characters
function _G.print(...)
  for i = 1, select("#", ...) do
    local text = text_of(tostring((select(i, ...)))) .. (i < select("#", ...) and "\t" or "\n")
    if room > 0 then printed[#printed + 1] = sub(text, 1, room) end
    room = room - #text
  end
end

local unset, seen = {}, {}
local function bind(kind, read)
  _G[kind] = function(name, default)
    if type(name) ~= "string" then
      error(kind .. " requires a name, got " .. type(name), 2)
    end
    local value = read(name)
    if value ~= nil then return value end
    local label = kind .. ' "' .. name .. '"'
    if default == nil and not seen[label] and #unset < 20 then
      seen[label] = true
      unset[#unset + 1] = label
    end
    return default
  end
end
bind("env", function(name)
  local text = getenv(name)
  return text and find(text, "^[+-]?[%d.][%d.eE+-]*$") and tonumber(text) or text
end)
bind("param", function(name)
  if not known[name] then
    requested = name
    stopped = "parameter"  -- set before `error`, because a hook can run in between
    error(stopped, 0)
  end
  return known[name][1]
end)

local chunk, value = load_text(code, "=$eval")
local ok = false
if chunk then
  -- A hook that runs right after the expression fails in `attempt`, not here.
  local function attempt()
    ok, value = pcall(chunk)
    ended = true
  end
  sethook(check, "c", interval)
  pcall(attempt)
  ended = true
  sethook()
end
local function answer(status, text) return status, text, concat(printed), unpack(unset) end
if requested then return "param", requested end
if stopped then return answer("error", stopped) end
local kind = type(value)
if kind == "nil" and ok then return answer("value", "") end
if value ~= value then value = "nan" end  -- Lua 5.1 prints a sign, LuaJIT does not
if kind == "boolean" then value = value and "true" or "false" end
if kind == "string" or kind == "number" or kind == "boolean" then
  return answer(ok and "value" or "error", text_of(value))
end
return answer("error", ok and "the result is a " .. kind .. ", not a value" or "error of type " .. kind)

-- Runs once in each Lua state, as its only chunk, and evaluates one expression. Everything that the
-- guards use is held in locals, so that the expression can neither read nor change it, whatever it
-- does to the globals.
local code, spent, time_limit, memory_limit, interval = ...
local error, ipairs, pairs, pcall, select, tonumber, tostring, type, unpack =
  error, ipairs, pairs, pcall, select, tonumber, tostring, type, unpack
local clock, getenv, sethook, memory_used = os.clock, os.getenv, debug.sethook, collectgarbage
local loadstring, create, resume = loadstring, coroutine.create, coroutine.resume
local byte, find, gsub, rep, sort = string.byte, string.find, string.gsub, string.rep, table.sort
local concat, insert = table.concat, table.insert

local known = {}  -- parameters: a table with the value, or with nothing for one that is unset
local given = {select(6, ...)}
for i = 1, select("#", ...) - 5, 2 do known[given[i]] = {given[i + 1]} end

if jit then jit.off() end  -- compiled code calls no hooks
for _, name in ipairs{"execute", "exit", "remove", "rename", "tmpname", "setlocale"} do
  os[name] = nil
end
for name in pairs(package.loaded) do package.loaded[name] = nil end
-- newproxy makes finalizers, and those run without hooks
for _, name in ipairs{"io", "package", "require", "module", "dofile", "loadfile", "debug",
                      "python", "newproxy", "jit", "ffi"} do
  _G[name] = nil
end

-- Stopping: once `stopped` is set, nothing that catches errors lets the expression run on.
local stopped, wanted
local start = clock() - spent
local check
function check()
  if not stopped and clock() - start > time_limit then
    stopped = "it runs for more than " .. time_limit .. " s"
  elseif not stopped and memory_used("count") * 1024 > memory_limit then
    stopped = "not enough memory"
  end
  if stopped then
    sethook(check, "", interval)  -- LuaJIT does not count anew after an error
    error(stopped, 0)
  end
end
local function pass(...)
  if stopped then error(stopped, 0) end
  return ...
end

function _G.pcall(...) return pass(pcall(...)) end
-- Lua's own calls the handler inside of the hook that has failed, where no hook stops it.
function _G.xpcall(run, handler)
  local function finish(ok, ...)
    if ok then return true, ... end
    return false, select(2, pass(pcall(handler, ...)))
  end
  return finish(pass(pcall(run)))
end
function coroutine.create(run)
  local thread = create(run)
  sethook(thread, check, "", interval)  -- each coroutine has its own
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

-- Text only: a forged binary chunk can do anything to the process.
function _G.loadstring(text, name)
  check()
  if type(text) == "string" and byte(text, 1) == 27 then
    return nil, "binary chunks are refused"
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

-- One call of these may work for ever, and no hook comes in between: the cost is bounded first.
local function limit(steps, what)
  check()
  if steps > 2e8 then error(what, 3) end  -- about 1 s
end
-- not tostring: the expression may have changed what that makes of strings
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
      -- %b and %1 go through the text too; sets are single characters
      local bare = gsub(gsub(text_of(pattern), "%%[b%d]", "x*"), "%%.", "x")
      bare = gsub(bare, "%[%^?.[^%]]*%]", "x")
      local _, many = gsub(bare, "[*+-]", "")
      local _, maybe = gsub(bare, "%?", "")
      local steps = (byte(bare, 1) == 94 and 1 or n + 1) * 2 ^ maybe * (1 + #bare / 8)
      for i = 1, many do steps = steps * (n + i) / i end
      limit(steps, "the pattern may take too long for a text of " .. n .. " characters")
    end
    if name == "gsub" and (n + 1) * #text_of(third) > memory_limit then
      error("not enough memory", 2)
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
local function is_index(number) return number > -1e9 and number < 1e9 end
function _G.unpack(list, first, last)
  first, last = tonumber(first) or 1, last == nil and #list or tonumber(last) or 0
  -- Lua 5.1 counts with 32 bits here; where that overflows, it crashes
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
function table.sort(list, less)
  return sort(list, less or function(a, b) return a < b end)  -- a Lua function lets hooks in
end

local unset, seen = {}, {}
local function bind(kind, read)
  _G[kind] = function(name, default)
    if type(name) ~= "string" then
      error(kind .. " needs a name, got " .. type(name), 2)
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
    wanted = name
    stopped = "parameter"  -- a hook may come in between
    error(stopped, 0)
  end
  return known[name][1]
end)

local chunk, value = load_text(code, "=$eval")
local ok = false
if chunk then
  -- a hook that comes right after the expression fails in `attempt`, not here
  local function attempt()
    ok, value = pcall(chunk)
    sethook()
  end
  sethook(check, "", interval)
  pcall(attempt)
  sethook()
end
if wanted then return "param", wanted end
if stopped then return "error", stopped end
local kind = type(value)
if kind == "nil" and ok then return "value", "", unpack(unset) end
if value ~= value then value = "nan" end  -- Lua 5.1 adds a sign, LuaJIT does not
if kind == "boolean" then value = value and "true" or "false" end
if kind == "string" or kind == "number" or kind == "boolean" then
  return ok and "value" or "error", text_of(value), unpack(unset)
end
return "error", ok and "the result is a " .. kind .. ", not a value" or "error of type " .. kind

-- Fields. Reals of both widths share one field: values are given as numbers, never as bytes.

local proto = Proto("openpendant", "ROS-Industrial simple message (openpendant)")

local DIRECTIONS = { [1] = "topic", [2] = "request", [3] = "reply" }
local REPLY_CODES = { [0] = "UNUSED", [1] = "SUCCESS", [2] = "FAILURE" }
local COMM_TYPES = { [0] = "INVALID", [1] = "TOPIC", [2] = "REQUEST", [3] = "REPLY" }

local header = {
    length = ProtoField.int32("openpendant.length", "length"),
    msg_type = ProtoField.int32("openpendant.msg_type", "message type", base.DEC, TYPE_NAMES),
    comm_type = ProtoField.int32("openpendant.comm_type", "communication type", base.DEC, COMM_TYPES),
    reply_code = ProtoField.int32("openpendant.reply_code", "reply code", base.DEC, REPLY_CODES),
    name = ProtoField.string("openpendant.name", "name"),
    byte_order = ProtoField.string("openpendant.byte_order", "byte order"),
    real_size = ProtoField.uint32("openpendant.real_size", "bytes of a real"),
    body = ProtoField.bytes("openpendant.body", "body"),
}

-- Not of the group "malformed": that filter is left to bytes which break a dissector.
local experts = {
    framing = ProtoExpert.new("openpendant.framing_fault", "no simple message",
        expert.group.PROTOCOL, expert.severity.ERROR),
    header = ProtoExpert.new("openpendant.header_fault", "header breaks a rule",
        expert.group.PROTOCOL, expert.severity.ERROR),
    body = ProtoExpert.new("openpendant.body_fault", "body is not as declared",
        expert.group.PROTOCOL, expert.severity.ERROR),
    reply = ProtoExpert.new("openpendant.other_reply", "reply with a body of the vendor's own",
        expert.group.PROTOCOL, expert.severity.NOTE),
    unknown = ProtoExpert.new("openpendant.unknown_type", "message type without a known layout",
        expert.group.UNDECODED, expert.severity.NOTE),
    refused = ProtoExpert.new("openpendant.refused", "refused",
        expert.group.RESPONSE_CODE, expert.severity.NOTE),
    cut = ProtoExpert.new("openpendant.cut_short", "cut short by the capture",
        expert.group.UNDECODED, expert.severity.WARN),
}

local all_fields = {}
for _, field in pairs(header) do all_fields[#all_fields + 1] = field end

local function label(field)
    if field.unit then return field.name .. " [" .. field.unit .. "]" end
    return field.name
end

-- Wireshark looks the names of values up by unsigned words.
local function unsigned(values)
    if not values then return nil end
    local names = {}
    for value, name in pairs(values) do names[value % 2 ^ 32] = name end
    return names
end

local function declare(path, fields)
    for _, field in ipairs(fields) do
        local filter = path .. "." .. field.name
        if field.kind == "array" then
            if field.count_name then
                field.count = ProtoField.int32(path .. "." .. field.count_name, field.count_name)
                all_fields[#all_fields + 1] = field.count
            end
            declare(filter, field.record)
        else
            if field.kind == "int" then
                field.proto = ProtoField.int32(
                    filter, label(field), base.DEC, unsigned(field.values), nil, field.meaning)
            elseif field.kind == "text" or field.kind == "json" then
                field.proto = ProtoField.string(filter, label(field), base.UNICODE, field.meaning)
            else
                field.proto = ProtoField.double(filter, label(field), base.NONE, field.meaning)
            end
            all_fields[#all_fields + 1] = field.proto
        end
    end
end

local by_type = {}
for _, message in ipairs(MESSAGES) do
    declare("openpendant." .. message.filter, message.fields)
    local layouts = by_type[message.type] or {}
    by_type[message.type] = layouts
    layouts[message.is_reply and "reply" or "other"] = message
end

proto.fields = all_fields
local all_experts = {}
for _, one in pairs(experts) do all_experts[#all_experts + 1] = one end
proto.experts = all_experts

-- Preferences.

proto.prefs.ports = Pref.range("TCP ports", DEFAULT_PORTS, "Ports that carry simple message", 65535)
proto.prefs.real_size = Pref.enum("Size of reals", 0, "Told by the size of the body, or always as chosen", {
    { 1, "told by the body, else 4", 0 }, { 2, "4 bytes", 4 }, { 3, "8 bytes", 8 },
}, false)

-- Bytes.

local LONGEST = 65535
local HEADER, PREFIX = 16, 4

local function int_at(tvb, at, little)
    if little then return tvb(at, 4):le_int() end
    return tvb(at, 4):int()
end

local function real_at(tvb, at, little, width)
    if little then return tvb(at, width):le_float() end
    return tvb(at, width):float()
end

-- Says whether a text is UTF-8, as strictly as Python does: no surrogates, nothing overlong.
local function is_utf8(text)
    local at, size = 1, #text
    while at <= size do
        local first = text:byte(at)
        local more, least = 0, 0
        if first >= 0xF0 and first <= 0xF4 then more, least = 3, 0x10000
        elseif first >= 0xE0 and first < 0xF0 then more, least = 2, 0x800
        elseif first >= 0xC2 and first < 0xE0 then more, least = 1, 0x80
        elseif first >= 0x80 then return false end
        local code = first
        if more > 0 then code = first % (2 ^ (6 - more)) end
        if at + more > size then return false end
        for i = 1, more do
            local byte = text:byte(at + i)
            if byte < 0x80 or byte > 0xBF then return false end
            code = code * 64 + byte % 64
        end
        if code < least or code > 0x10FFFF or (code >= 0xD800 and code <= 0xDFFF) then return false end
        at = at + more + 1
    end
    return true
end

local function text_of(range)
    local raw = range:raw()
    local stop = raw:find("\0", 1, true)
    if stop then raw = raw:sub(1, stop - 1) end
    return raw
end

-- Returns whether the length at `at` is little-endian; nil where neither reading is a length.
local function byte_order(tvb, at)
    local little, big = tvb(at, 4):le_int(), tvb(at, 4):int()
    if little >= HEADER - PREFIX and little <= LONGEST then return true, little end
    if big >= HEADER - PREFIX and big <= LONGEST then return false, big end
    return nil
end

-- Layout.

local function fixed_size(field, width)
    if field.kind == "int" then return 4 end
    if field.kind == "real" then return width end
    if field.kind == "reals" then return field.size * width end
    if field.kind == "text" then return field.size end
    return 0
end

local function size_of(fields, width)
    local size = 0
    for _, field in ipairs(fields) do size = size + fixed_size(field, width) end
    return size
end

local function has_reals(fields)
    for _, field in ipairs(fields) do
        if field.kind == "real" or field.kind == "reals" then return true end
        if field.kind == "array" and has_reals(field.record) then return true end
    end
    return false
end

-- Returns the offset of an int field in the head of a message.
local function offset_of(fields, name, width)
    local at = 0
    for _, field in ipairs(fields) do
        if field.name == name then return at end
        at = at + fixed_size(field, width)
    end
end

-- Returns how many records the array at the end of a body holds, or nil and the reason.
local function records_in(message, array, tvb, little, width)
    local head = size_of(message.fields, width)
    local record = size_of(array.record, width)
    local rest = tvb:len() - HEADER - head
    local counted = array.count_name and 4 or 0
    local number = (rest - counted) / record
    if rest < counted or number ~= math.floor(number) or number < array.least or number > array.most then
        return nil, string.format("%d bytes are no %d to %d records of %d bytes",
            rest, array.least, array.most, record)
    end
    if array.count_name then
        local at = HEADER + head
        if array.count_place == "after" then at = at + number * record end
        local count = int_at(tvb, at, little)
        if count ~= number then
            return nil, string.format("%s is %d, the body holds %d records", array.count_name, count, number)
        end
    end
    if array.meant_by then
        local at = HEADER + offset_of(message.fields, array.meant_by, width)
        local meant = int_at(tvb, at, little)
        if meant < array.least or meant > number or (number ~= meant and number ~= array.most) then
            return nil, string.format("%s is %d, the body holds %d records", array.meant_by, meant, number)
        end
    end
    return number
end

-- Returns the first text of a body that is not UTF-8.
local function broken_text(message, tvb, width)
    local at = HEADER
    for _, field in ipairs(message.fields) do
        if field.kind == "text" and not is_utf8(text_of(tvb(at, field.size))) then return field.name end
        at = at + fixed_size(field, width)
    end
end

-- Says whether a body has the declared layout with reals of a width; the second value is why not.
local function fits(message, tvb, little, width)
    local size = tvb:len() - HEADER
    local head = size_of(message.fields, width)
    local last = message.fields[#message.fields]
    local kind = last and last.kind
    if kind == "array" then
        if size < head then
            return false, string.format("the body has %d bytes, its head %d", size, head)
        end
        local number, reason = records_in(message, last, tvb, little, width)
        if not number then return false, reason end
    elseif kind == "json" and size < head then
        return false, string.format("the body has %d bytes, its head %d", size, head)
    elseif kind ~= "json" and size ~= head then
        return false, string.format("the body has %d bytes, not %d", size, head)
    end
    local broken = broken_text(message, tvb, width)
    if broken then return false, broken .. " is not UTF-8" end
    return true
end

-- Returns the width of reals with which a body fits, or nil and the reason why none does.
local function width_of(message, tvb, little)
    local preferred = proto.prefs.real_size
    local widths = { 4, 8 }
    if preferred == 4 or preferred == 8 then widths = { preferred } end
    local first_reason
    for _, width in ipairs(widths) do
        local ok, reason = fits(message, tvb, little, width)
        if ok then return width end
        first_reason = first_reason or reason
    end
    return nil, first_reason
end

-- Showing.

local SHOWN_IN_INFO = { sequence = true, request_id = true, command = true, result = true, subcode = true, code = true }

-- Returns the names of the bits of a value, those without a name in hexadecimal; nil for none.
local function bits_of(field, value)
    local set, rest = {}, value % 2 ^ 32
    for _, bit in ipairs(field.bits) do
        if math.floor(rest / bit[1]) % 2 == 1 then
            set[#set + 1] = bit[2]
            rest = rest - bit[1]
        end
    end
    if #set == 0 then return nil end
    if rest > 0 then set[#set + 1] = string.format("0x%x", rest) end
    return table.concat(set, "|")
end

local function show_int(tree, field, tvb, at, little, notes)
    local value = int_at(tvb, at, little)
    if field.keeps then value = value % field.keeps end
    local item = tree:add(field.proto, tvb(at, 4), value)
    local bits = field.bits and bits_of(field, value)
    if bits then item:append_text(" (" .. bits .. ")") end
    if notes and SHOWN_IN_INFO[field.name] then
        notes[#notes + 1] = string.format("%s=%s", field.name, field.values and field.values[value] or value)
    end
end

local function show_reals(tree, field, tvb, at, little, width)
    local branch = tree:add(tvb(at, field.size * width), label(field))
    for index = 0, field.size - 1 do
        local place = at + index * width
        local item = branch:add(field.proto, tvb(place, width), real_at(tvb, place, little, width))
        item:prepend_text(string.format("[%d] ", index))
    end
end

local function show_json(tree, field, tvb, at)
    if at == tvb:len() then return end
    local range = tvb(at)
    local text = range:raw()
    if is_utf8(text) and not text:find("\0", 1, true) then
        tree:add(field.proto, range, text)
    else
        tree:add(field.proto, range)
    end
end

local show_fields

local function show_records(tree, message, array, tvb, at, little, width)
    local number = records_in(message, array, tvb, little, width)
    local record = size_of(array.record, width)
    if array.count_name and array.count_place == "before" then
        tree:add(array.count, tvb(at, 4), number)
        at = at + 4
    end
    for index = 0, number - 1 do
        local branch = tree:add(tvb(at, record), string.format("%s[%d]", array.name, index))
        show_fields(branch, message, array.record, tvb, at, little, width)
        at = at + record
    end
    if array.count_name and array.count_place == "after" then
        tree:add(array.count, tvb(at, 4), number)
    end
end

show_fields = function(tree, message, fields, tvb, at, little, width, notes)
    for _, field in ipairs(fields) do
        if field.kind == "int" then
            show_int(tree, field, tvb, at, little, notes)
        elseif field.kind == "real" then
            tree:add(field.proto, tvb(at, width), real_at(tvb, at, little, width))
        elseif field.kind == "reals" then
            show_reals(tree, field, tvb, at, little, width)
        elseif field.kind == "text" then
            local range = tvb(at, field.size)
            tree:add(field.proto, range, text_of(range))
        elseif field.kind == "json" then
            show_json(tree, field, tvb, at)
        else
            show_records(tree, message, field, tvb, at, little, width)
        end
        at = at + fixed_size(field, width)
    end
end

-- Frames.

local function broken_rule(msg_type, comm_type, reply_code)
    if msg_type == 0 then return "message type 0 is reserved" end
    if comm_type == 0 then return "communication type 0 is invalid" end
    if (comm_type == 3) == (reply_code == 0) then
        return string.format("reply code %d does not go with communication type %d", reply_code, comm_type)
    end
end

local function layout_of(msg_type, comm_type)
    local layouts = by_type[msg_type]
    if not layouts then return nil end
    if comm_type == 3 and layouts.reply then return layouts.reply end
    return layouts.other
end

local function show_raw(tree, tvb)
    if tvb:len() > HEADER then tree:add(header.body, tvb(HEADER)) end
end

-- Shows a body and returns what the info column says of it.
local function show_body(tree, message, tvb, comm_type, little)
    if not message then
        show_raw(tree, tvb)
        if comm_type ~= 3 or tvb:len() > HEADER then tree:add_proto_expert_info(experts.unknown) end
        return {}
    end
    if message.any_body then
        show_raw(tree, tvb)
        return {}
    end
    local width, reason = width_of(message, tvb, little)
    if not width then
        show_raw(tree, tvb)
        if comm_type ~= 3 then
            tree:add_proto_expert_info(experts.body, reason)
            return { "[malformed: " .. reason .. "]" }
        end
        if tvb:len() > HEADER then tree:add_proto_expert_info(experts.reply, reason) end
        return {}
    end
    if has_reals(message.fields) then tree:add(header.real_size, width):set_generated() end
    local notes = {}
    show_fields(tree, message, message.fields, tvb, HEADER, little, width, notes)
    return notes
end

local function show_framing_fault(tvb, pinfo, root, reason)
    local tree = root:add(proto, tvb(), "Simple message: " .. reason)
    tree:add(header.body, tvb())
    tree:add_proto_expert_info(experts.framing, reason)
    pinfo.cols.info:append("[" .. reason .. "] ")
end

-- Dissects one whole frame.
local function dissect_frame(tvb, pinfo, root)
    local size = tvb:len()
    if size < PREFIX then
        if size > 0 then show_framing_fault(tvb, pinfo, root, "less than a length") end
        return size
    end
    local little, length = byte_order(tvb, 0)
    if little == nil then
        show_framing_fault(tvb, pinfo, root, "no length between 12 and 65535 in either byte order")
        return size
    end
    local tree = root:add(proto, tvb())
    tree:add(header.length, tvb(0, 4), length)
    tree:add(header.byte_order, little and "little" or "big"):set_generated()
    if size < HEADER or size < PREFIX + length then
        if size > PREFIX then tree:add(header.body, tvb(PREFIX)) end
        tree:add_proto_expert_info(experts.cut)
        pinfo.cols.info:append("[cut short] ")
        return size
    end
    local msg_type, comm_type, reply_code = int_at(tvb, 4, little), int_at(tvb, 8, little), int_at(tvb, 12, little)
    local message = layout_of(msg_type, comm_type)
    local name = message and message.name or NAMED_OPAQUE[msg_type] or "unknown"
    tree:add(header.msg_type, tvb(4, 4), msg_type)
    tree:add(header.comm_type, tvb(8, 4), comm_type)
    tree:add(header.reply_code, tvb(12, 4), reply_code)
    tree:add(header.name, name):set_generated()
    local kind = DIRECTIONS[comm_type] or string.format("communication type %d", comm_type)
    local words = { name .. "(" .. string.format("%d", msg_type) .. ")", kind }
    if comm_type == 3 then words[#words + 1] = REPLY_CODES[reply_code] or string.format("code %d", reply_code) end
    local rule = broken_rule(msg_type, comm_type, reply_code)
    if rule then
        show_raw(tree, tvb)
        tree:add_proto_expert_info(experts.header, rule)
        words[#words + 1] = "[" .. rule .. "]"
    else
        for _, note in ipairs(show_body(tree, message, tvb, comm_type, little)) do words[#words + 1] = note end
        if comm_type == 3 and reply_code == 2 then tree:add_proto_expert_info(experts.refused) end
    end
    local summary = table.concat(words, " ")
    tree:append_text(", " .. summary)
    pinfo.cols.info:append(summary .. "  ")
    return size
end

-- Returns the size of the frame at `at`; what has no length is taken as one piece to its end.
local function frame_size(tvb, pinfo, at)
    local left = tvb:reported_length_remaining(at)
    if tvb:len() - at < PREFIX then return left end
    local little, length = byte_order(tvb, at)
    if little == nil then return left end
    return PREFIX + length
end

function proto.dissector(tvb, pinfo, tree)
    pinfo.cols.protocol = "SimpleMessage"
    pinfo.cols.info = ""
    dissect_tcp_pdus(tvb, tree, PREFIX, frame_size, dissect_frame, true)
    return tvb:len()
end

-- Takes a stream on any port whose first bytes are a frame of a known type with a sound header.
local function heuristic(tvb, pinfo, tree)
    if tvb:len() < HEADER then return false end
    local little = byte_order(tvb, 0)
    if little == nil then return false end
    local msg_type, comm_type, reply_code = int_at(tvb, 4, little), int_at(tvb, 8, little), int_at(tvb, 12, little)
    if not by_type[msg_type] or comm_type < 1 or comm_type > 3 then return false end
    if reply_code < 0 or reply_code > 2 or broken_rule(msg_type, comm_type, reply_code) then return false end
    pinfo.conversation = proto
    proto.dissector(tvb, pinfo, tree)
    return true
end

proto:register_heuristic("tcp", heuristic)

local tcp_ports = DissectorTable.get("tcp.port")
local registered = ""

local function register_ports()
    if registered ~= "" then tcp_ports:remove(registered, proto) end
    registered = proto.prefs.ports
    if registered ~= "" then tcp_ports:add(registered, proto) end
end

proto.prefs_changed = register_ports
register_ports()
